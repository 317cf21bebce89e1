"""What a command may replace: a file that cdtool wrote, known by what it holds and not by its name; no other unasked.

Every kind of file that cdtool writes over has a mark in its first or last 8 KB. `--force` lifts this for a command that
has it, and never for a file that the command reads.
"""

from __future__ import annotations

import zlib
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from cdtool.errors import UsageError
from cdtool.plain_text import plain

_LOOKED_AT = 1 << 13


@dataclass(frozen=True)
class Kind:
    """A kind of file that cdtool writes: what all of them hold, and what they are called in a message."""

    mark: bytes
    words: str

    def is_kind_of(self, path: Path) -> bool:
        """Whether a file is of this kind; an empty one is of every kind. Raises UsageError where it cannot be read."""
        try:
            with path.open("rb") as file:
                head = file.read(_LOOKED_AT)
                file.seek(max(len(head), path.stat().st_size - _LOOKED_AT))
                tail = file.read(_LOOKED_AT)
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
    """Raise UsageError where something other than `kind` would be replaced. `force` is None where there is no --force.

    Links are followed. Where there is nothing, an empty file, or a device or pipe, nothing can be lost.
    """
    if force or not target.is_file() or kind.is_kind_of(target):
        return
    way_out = "remove it first" if force is None else "overwrite it with --force"
    raise UsageError(f"{plain(target)}: already exists and holds no {kind.words}", f"choose another name, or {way_out}")


def refuse_foreign_figure(target: Path, *, force: bool) -> None:
    """Raise UsageError where a figure would replace what cdtool did not draw."""
    if target.suffix.lower() in FIGURES:
        refuse_other_kind(target, FIGURES[target.suffix.lower()], force=force)


def refuse_inputs(targets: Iterable[Path], inputs: Iterable[Path]) -> None:
    """Raise UsageError where a file to write is one that the command reads, under whatever name or link."""
    read = [path for path in inputs if path.exists()]
    for target in targets:
        if target.exists() and any(target.samefile(path) for path in read):
            raise UsageError(f"{plain(target)}: is read by this command", "choose another name to write to")


def _unpacked(head: bytes) -> bytes:
    """The beginning of what a gzip file holds; nothing of another file."""
    if not head.startswith(b"\x1f\x8b"):
        return b""
    try:
        return zlib.decompressobj(16 + zlib.MAX_WBITS).decompress(head, _LOOKED_AT)
    except zlib.error:
        return b""
