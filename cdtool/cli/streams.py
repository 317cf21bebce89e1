"""Standard output and error: a reader that has gone, a full disk or a narrow encoding raises nothing.

A pager or `head` may close the pipe before a command ends: the rest is dropped, the command goes on, and its exit
status is its own. Characters that the terminal's encoding does not have are replaced by "?".
"""

from __future__ import annotations

import errno
import io
import os
import sys
from pathlib import Path
from typing import TextIO

_STANDARD_INPUT_OUTPUT_ERROR = range(3)


class _Descriptor(io.FileIO):
    """A descriptor that never fails: what cannot be written is dropped, and the first reason is kept."""

    fault: OSError | None = None

    def write(self, content: object, /) -> int:
        """All of the content, or as much as the descriptor takes at once."""
        if self.fault is None:
            try:
                return super().write(content)  # type: ignore[arg-type]
            except OSError as fault:
                self.fault = fault
        return memoryview(content).nbytes  # type: ignore[arg-type]


class _Stream(io.TextIOWrapper):
    """A text stream without a binary one below it: click would write UTF-8 there where the encoding is ASCII."""

    buffer = None  # type: ignore[assignment]
    descriptor: _Descriptor


def open_standard_streams() -> None:
    """Make standard output and error such that printing to them raises nothing; call it before anything is printed.

    Streams that are no longer the process's own, as under a test runner, are left as they are.
    """
    for descriptor in _STANDARD_INPUT_OUTPUT_ERROR:  # a closed one would become that of the next file that is opened
        try:
            os.fstat(descriptor)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
    sys.stdout, sys.stderr = _opened(sys.stdout, 1), _opened(sys.stderr, 2)


def lost_output() -> OSError | None:
    """Why standard output could not be written, if it was not because its reader has gone."""
    stream = sys.stdout
    if not isinstance(stream, _Stream):
        return None
    stream.flush()
    fault = stream.descriptor.fault
    return None if fault is None or fault.errno == errno.EPIPE else fault


def _opened(stream: TextIO | None, descriptor: int) -> TextIO:
    if stream is None:  # it was closed when Python started
        return Path(os.devnull).open("w", encoding="utf-8")
    if type(stream) is not io.TextIOWrapper or stream.fileno() != descriptor:
        return stream
    if os.name != "posix":  # a Windows console has a writer of its own
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
