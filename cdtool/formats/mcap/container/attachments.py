"""Check attachments (op=0x09) in pieces, so that a large attachment does not need memory."""

from __future__ import annotations

from cdtool.formats.mcap.container.damage import DamageError
from cdtool.formats.mcap.container.file_bytes import FileBytes
from cdtool.formats.mcap.container.records import PREFIX, AttachmentIndex
from cdtool.formats.mcap.container.serialisation import string, uint64

_LONGEST_TEXT = 1 << 16


def check_attachment(file: FileBytes, at: int, length: int, *, with_crc: bool = True) -> None:
    """Check the attachment record of `length` bytes at byte `at`, its content `with_crc`; raises DamageError."""
    index, end = _read(file, at, length)
    end += index.data_size
    if end + 4 > at + length:
        raise DamageError("the declared data size of an attachment exceeds its record")
    if not with_crc:
        return
    stated = int.from_bytes(file.read(end, 4), "little")
    if stated and stated != file.crc(at + PREFIX, end):
        raise DamageError("the checksum of an attachment does not match")


def attachment_index(file: FileBytes, at: int, length: int) -> AttachmentIndex:
    """Return the index of the attachment record of `length` bytes at byte `at`; raises DamageError."""
    return _read(file, at, length)[0]


def _read(file: FileBytes, at: int, length: int) -> tuple[AttachmentIndex, int]:
    """Return all fields except the data, and the byte where the data start."""
    head = file.read(at + PREFIX, min(length - PREFIX, 2 * _LONGEST_TEXT))
    log_time, offset = uint64(head, 0)
    create_time, offset = uint64(head, offset)
    name, offset = string(head, offset)
    media_type, offset = string(head, offset)
    size, offset = uint64(head, offset)
    return AttachmentIndex(at, length, log_time, create_time, size, name, media_type), at + PREFIX + offset
