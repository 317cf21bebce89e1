"""What stands at the two ends of a file: its header's profile, and bytes behind its end ("File Structure")."""

from __future__ import annotations

from cdtool.formats.mcap.container.damage import DamageError
from cdtool.formats.mcap.container.file_bytes import FileBytes
from cdtool.formats.mcap.container.records import MAGIC, PREFIX, Footer, Header

_LONGEST_HEADER = 1 << 12


def profile_of(file: FileBytes) -> str:
    """What the header calls the file's profile, `ros2` for one; empty where there is none."""
    head = file.read(len(MAGIC), PREFIX)
    length = int.from_bytes(head[1:], "little")
    if len(head) < PREFIX or head[0] != Header.opcode or length > _LONGEST_HEADER:
        return ""
    try:
        return Header.read(file.read(len(MAGIC) + PREFIX, length)).profile
    except DamageError:
        return ""


def end_of_log(file: FileBytes, at: int) -> int | None:
    """Where the log ends whose end of data stands at byte `at`: behind the magic bytes that follow its footer."""
    while True:
        head = file.read(at, PREFIX)
        length = PREFIX + int.from_bytes(head[1:], "little")
        if len(head) < PREFIX or not head[0] or length > file.size - at:
            return None
        at += length
        if head[0] == Footer.opcode:
            return at + len(MAGIC) if bytes(file.read(at, len(MAGIC))) == MAGIC else None
