"""What a library would print of a file on the error output: collected, to be told as findings."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager


class _Lines(logging.Handler):
    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.lines: list[str] = []

    def emit(self, record: logging.LogRecord) -> None:
        self.lines.append(" ".join(record.getMessage().split())[:200])


@contextmanager
def collected_lines(library: str) -> Iterator[list[str]]:
    """The warnings that a library's loggers give within; none of them is printed, by its own handlers or others'.

    The loggers are those of the modules that are imported. Files that are read at the same time share their lines.
    """
    known = [name for name in logging.Logger.manager.loggerDict if name == library or name.startswith(f"{library}.")]
    loggers = [logging.getLogger(name) for name in known]
    before = [(logger.handlers, logger.propagate) for logger in loggers]
    collector = _Lines()
    for logger in loggers:
        logger.handlers, logger.propagate = [collector], False
    try:
        yield collector.lines
    finally:
        for logger, (handlers, propagate) in zip(loggers, before, strict=True):
            logger.handlers, logger.propagate = handlers, propagate
