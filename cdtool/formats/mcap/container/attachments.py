"""Attachments (op=0x09): looked at in pieces, so that a large one takes no memory."""

from __future__ import annotations

from cdtool.formats.mcap.container.damage import DamageError
from cdtool.formats.mcap.container.file_bytes import FileBytes
from cdtool.formats.mcap.container.records import PREFIX, AttachmentIndex
from cdtool.formats.mcap.container.serialisation import string, uint64

_LONGEST_TEXT = 1 << 16


def check_attachment(file: FileBytes, at: int, length: int) -> None:
    """Check the attachment record of `length` bytes at byte `at`; raises DamageError."""
    index, place = _read(file, at, length)
    place += index.data_size
    if place + 4 > at + length:
        raise DamageError("an attachment's data claim more bytes than it has")
    stated = int.from_bytes(file.read(place, 4), "little")
    if stated and stated != file.crc(at + PREFIX, place):
        raise DamageError("the checksum of an attachment does not fit")


def attachment_index(file: FileBytes, at: int, length: int) -> AttachmentIndex:
    """What an index tells of the attachment record of `length` bytes at byte `at`; raises DamageError."""
    return _read(file, at, length)[0]


def _read(file: FileBytes, at: int, length: int) -> tuple[AttachmentIndex, int]:
    """All fields but the data, and where these begin."""
    head = file.read(at + PREFIX, min(length - PREFIX, 2 * _LONGEST_TEXT))
    log_time, place = uint64(head, 0)
    create_time, place = uint64(head, place)
    name, place = string(head, place)
    media_type, place = string(head, place)
    size, place = uint64(head, place)
    return AttachmentIndex(at, length, log_time, create_time, size, name, media_type), at + PREFIX + place
