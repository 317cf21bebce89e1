"""Standard output and error that never raise: for a closed pipe, a full disk or a narrow encoding.

A pager or `head` may close the pipe before a command ends. The remaining output is dropped, the command continues, and
its exit status does not change. Characters that the terminal's encoding does not have are replaced by "?".
"""

from __future__ import annotations

import errno
import io
import logging
import os
import sys
from pathlib import Path
from time import monotonic
from typing import TextIO

_STANDARD_INPUT_OUTPUT_ERROR = range(3)
_IS_WINDOWS = os.name == "nt"


class Pace(logging.Handler):
    """Lines on stderr about progress: at most one per minute, or `every` s, the first one at once on a terminal."""

    def __init__(self, every: float = 60.0) -> None:  # s
        super().__init__()
        self._every = every
        self._due = monotonic() + (0.0 if sys.stderr.isatty() else every)

    def is_due(self) -> bool:
        """Return whether a line is due; the next one then is due later."""
        now = monotonic()
        if now < self._due:
            return False
        self._due = now + self._every
        return True

    def show(self, line: str) -> None:
        """Print a line if one is due."""
        if self.is_due():
            print(line, file=sys.stderr, flush=True)

    def emit(self, record: logging.LogRecord) -> None:
        """Print the message of a record if one is due."""
        self.show(record.getMessage())


class _Descriptor(io.FileIO):
    """A file descriptor that never fails: unwritable output is dropped, and the first error is kept."""

    fault: OSError | None = None

    def write(self, content: object, /) -> int:
        """Return the number of bytes written; after an error, all of them."""
        if self.fault is None:
            try:
                return super().write(content)  # type: ignore[arg-type]
            except OSError as fault:
                self.fault = fault
        return memoryview(content).nbytes  # type: ignore[arg-type]


class _Stream(io.TextIOWrapper):
    """A text stream without a binary buffer: click would write UTF-8 to it even if the encoding is ASCII."""

    buffer = None  # type: ignore[assignment]
    descriptor: _Descriptor


def open_standard_streams() -> None:
    """Replace standard output and error so that printing never raises; call it before anything is printed.

    Streams that no longer belong to the process, as under a test runner, are not changed.
    """
    for descriptor in _STANDARD_INPUT_OUTPUT_ERROR:  # the next opened file would take the number of a closed one
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
    sys.stdout, sys.stderr = _opened(sys.stdout, 1), _opened(sys.stderr, 2)


def lost_output() -> OSError | None:
    """Return why standard output could not be written, or None; a closed pipe is not an error."""
    stream = sys.stdout
    if not isinstance(stream, _Stream):
        return None
    stream.flush()
    fault = stream.descriptor.fault
    # Windows has no error of its own for a closed pipe.
    closed_pipe = (errno.EPIPE, errno.EINVAL) if _IS_WINDOWS else (errno.EPIPE,)
    return None if fault is None or fault.errno in closed_pipe else fault


def _opened(stream: TextIO | None, descriptor: int) -> TextIO:
    if stream is None:  # closed when Python started
        return Path(os.devnull).open("w", encoding="utf-8")
    if type(stream) is not io.TextIOWrapper or stream.fileno() != descriptor:
        return stream
    if _IS_WINDOWS and stream.isatty():  # a console there has its own writer
        stream.reconfigure(errors="replace")
        return stream
    stream.flush()
    raw = _Descriptor(descriptor, "wb", closefd=False)
    made = _Stream(
        io.BufferedWriter(raw),
        encoding=stream.encoding,
        errors="replace",
        line_buffering=stream.line_buffering or descriptor == 2,
        write_through=stream.write_through,
    )
    made.descriptor = raw
    return made
