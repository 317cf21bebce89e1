"""Which files a command may replace: files written by cdtool, recognised by content and not by name.

Every kind of file that cdtool replaces has a mark in its first or last 8 KB. `--force`, in commands that have it,
allows other files too, but never a file that the command reads.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from cdtool.base.errors import UsageError
from cdtool.base.files.kinds import LOOKED_AT
from cdtool.base.plain_text import plain
from cdtool.base.remote.remote_path import is_remote


@dataclass(frozen=True)
class Kind:
    """A kind of file that cdtool writes: the mark in all of them, and their name in a message.

    `anywhere`: the mark may be in the middle of a long file.
    """

    mark: bytes
    words: str
    anywhere: bool = False

    def is_kind_of(self, path: Path) -> bool:
        """Whether a file is of this kind; an empty one is of every kind. Raises UsageError if it cannot be read."""
        try:
            with path.open("rb") as file:
                head = file.read() if self.anywhere else file.read(LOOKED_AT)
                file.seek(max(len(head), path.stat().st_size - LOOKED_AT))
                tail = file.read(LOOKED_AT)
        except OSError as fault:
            raise UsageError(
                f"{plain(path)}: already exists and cannot be read: {fault.strerror}", "choose another name"
            ) from fault
        return not head or self.mark in head or self.mark in tail or self.mark in _unpacked(head)


FIGURES = {
    ".png": Kind(b"Software\x00cdtool", "figure of cdtool"),
    ".svg": Kind(b"<dc:title>cdtool</dc:title>", "figure of cdtool"),
    ".pdf": Kind(b"/Creator (cdtool)", "figure of cdtool"),
}


def refuse_other_kind(target: Path, kind: Kind, *, force: bool | None = None) -> None:
    """Raise UsageError if a file of another kind would be replaced. `force` is None for a command without --force.

    Links are followed. A missing or empty file, a device or a pipe may always be written.
    """
    if force or not target.is_file() or kind.is_kind_of(target):
        return
    way_out = "remove it first" if force is None else "overwrite it with --force"
    raise UsageError(
        f"{plain(target)}: already exists and contains no {kind.words}", f"choose another name, or {way_out}"
    )


def refuse_foreign_figure(target: Path, *, force: bool) -> None:
    """Raise UsageError if a figure would replace a file that cdtool did not draw."""
    if target.suffix.lower() in FIGURES:
        refuse_other_kind(target, FIGURES[target.suffix.lower()], force=force)


def refuse_inputs(targets: Iterable[Path], inputs: Iterable[Path]) -> None:
    """Raise UsageError if a file to write is also read by the command, under any name or link."""
    given = list(inputs)
    read = [path for path in given if not is_remote(path) and path.exists()]
    for target in targets:
        if is_remote(target):
            is_read = target in given
        else:
            is_read = target.exists() and any(target.samefile(path) for path in read)
        if is_read:
            raise UsageError(f"{plain(target)}: is read by this command", "choose another name for the output")


def _unpacked(head: bytes) -> bytes:
    """Return the beginning of the content of a gzip file; empty for another file."""
    if not head.startswith(b"\x1f\x8b"):
        return b""
    try:
        return zlib.decompressobj(16 + zlib.MAX_WBITS).decompress(head, LOOKED_AT)
    except zlib.error:
        return b""
