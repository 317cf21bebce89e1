"""Writing a file of a report: complete or not at all."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO
from uuid import uuid4

from cdtool.errors import CdtoolError
from cdtool.plain_text import plain


def write_whole(path: Path, write: Callable[[BinaryIO], object]) -> None:
    """Let `write` fill a temporary file beside `path`, then rename it; raises CdtoolError where it cannot."""
    target = path.resolve()
    # A device or a pipe cannot be renamed over.
    temporary = None if target.exists() and not target.is_file() else target.parent / f".cdtool-{uuid4().hex}.tmp"
    try:
        with (temporary or target).open("xb" if temporary else "wb") as stream:
            write(stream)
        if temporary:
            os.replace(temporary, target)  # noqa: PTH105
    except OSError as fault:
        raise CdtoolError(f"{plain(path)} cannot be written: {fault.strerror or fault}", _hint(target)) from fault
    finally:
        if temporary:
            temporary.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> None:
    """Write UTF-8 text with the line ends that it has; raises CdtoolError."""
    write_whole(path, lambda stream: stream.write(text.encode("utf-8", "replace")))


def _hint(target: Path) -> str:
    if target.is_dir():
        return "it is a folder: give a file name"
    if not target.parent.is_dir():
        return f"make the folder {plain(target.parent)} first"
    return f"check that {plain(target.parent)} may be written to and has room"
