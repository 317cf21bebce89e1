"""Writing a file whole or not at all, and never over a file of another kind: a recording, a machine file."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from cdtool.errors import CdtoolError, RecordingError, UsageError
from cdtool.plain_text import plain

# A file's kind shows in its first bytes.
_HEAD = 1 << 13


@contextmanager
def written_file(target: Path) -> Iterator[Path]:
    """A path to write to, with the target's suffix; it becomes `target` where the block ends without an error.

    Where it ends with one nothing is left behind. Raises UsageError where the folder is missing or cannot be written,
    RecordingError where writing fails in the block or behind it, on a full disk for instance.
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
        with part.open("rb+") as file:
            os.fsync(file.fileno())  # a disk that is full may show only now
        part.chmod(0o644)
        part.replace(target)
    except CdtoolError as fault:
        # Nobody knows the temporary file by its name.
        raise type(fault)(fault.message.replace(str(part), str(target)), fault.hint) from fault
    except OSError as fault:
        why = os.strerror(fault.errno) if fault.errno else " ".join(str(fault).split())[:200]
        raise RecordingError(f"{target}: cannot be written: {why}", "check the folder and its space") from fault
    finally:
        part.unlink(missing_ok=True)


def refuse_other_kind(target: Path, mark: bytes, kind: str) -> None:
    """Raise UsageError where something other than `kind` would be replaced: what `target` holds, not its name, tells.

    Every file of that kind has `mark` in its first 8 KB. Links are followed. Where there is nothing, an empty file, or
    a device or pipe, nothing can be lost.
    """
    if not target.is_file():
        return
    try:
        with target.open("rb") as file:
            head = file.read(_HEAD)
    except OSError as fault:
        raise UsageError(
            f"{plain(target)}: is there and cannot be read: {fault.strerror}", "choose another name"
        ) from fault
    if head and mark not in head:
        raise UsageError(
            f"{plain(target)}: is there already and holds no {kind}", "choose another name, or remove it first"
        )


def refuse_inputs(targets: Iterable[Path], inputs: Iterable[Path]) -> None:
    """Raise UsageError where a file to write is one that the command reads, under whatever name or link."""
    read = [path for path in inputs if path.exists()]
    for target in targets:
        if target.exists() and any(target.samefile(path) for path in read):
            raise UsageError(f"{plain(target)}: is read by this command", "choose another name to write to")
