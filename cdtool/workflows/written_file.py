"""Writing a file whole or not at all: a temporary file beside it, then renamed."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from cdtool.errors import CdtoolError, UsageError


@contextmanager
def written_file(target: Path) -> Iterator[Path]:
    """A path to write to, with the target's suffix; it becomes `target` where the block ends without an error.

    Where it ends with one nothing is left behind. Raises UsageError where the folder is missing or cannot be written.
    """
    if target.is_dir():
        raise UsageError(f"{target}: is a folder", "give the name of a file")
    if not target.parent.is_dir():
        raise UsageError(f"{target}: no folder {target.parent}", "make it first")
    try:
        handle, name = tempfile.mkstemp(prefix=f".{target.stem}.", suffix=target.suffix, dir=target.parent)
    except OSError as fault:
        raise UsageError(f"{target}: cannot be written: {fault.strerror}", "check the folder's permissions") from fault
    os.close(handle)
    part = Path(name)
    try:
        yield part
        part.chmod(0o644)
        part.replace(target)
    except CdtoolError as fault:
        # Nobody knows the temporary file by its name.
        raise type(fault)(fault.message.replace(str(part), str(target)), fault.hint) from fault
    finally:
        part.unlink(missing_ok=True)
