"""One line on the terminal when kernels are compiled: the first command after installation takes much longer."""

from __future__ import annotations

import logging
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import typer

from cdtool.plain_text import one_line

# The logger on which `cdtool.kernel_cache` reports that it compiles.
_LOGGER = logging.getLogger("cdtool.kernel_cache")


class _Line(logging.Handler):
    """Print each message as a line on stderr; above a progress bar if there is one."""

    def emit(self, record: logging.LogRecord) -> None:
        """Print the message of a record."""
        typer.echo(one_line(record.getMessage()), err=True)


@contextmanager
def compilation_shown() -> Iterator[None]:
    """Show in the block that kernels are being compiled; nothing is shown if stderr is not a terminal."""
    if not sys.stderr.isatty():
        yield
        return
    before, handler = _LOGGER.level, _Line()
    _LOGGER.addHandler(handler)
    _LOGGER.setLevel(logging.INFO)
    try:
        yield
    finally:
        _LOGGER.setLevel(before)
        _LOGGER.removeHandler(handler)
