"""Check attachments (op=0x09) in pieces, so that a large attachment does not need memory."""

from __future__ import annotations

import struct

from cdtool.formats.mcap.file_bytes import FileBytes
from cdtool.formats.mcap.records import PREFIX, DamageError

_LONGEST_TEXT = 1 << 16


def check_attachment(file: FileBytes, at: int, length: int, *, with_crc: bool = True) -> None:
    """Check the attachment record of `length` bytes at byte `at`, its content `with_crc`; raises DamageError."""
    head = file.read(at + PREFIX, min(length - PREFIX, 2 * _LONGEST_TEXT))
    try:
        offset = 16  # after two times
        for _ in range(2):
            (size,) = struct.unpack_from("<I", head, offset)
            struct.unpack_from(f"<{size}s", head, offset + 4)[0].decode()
            offset += 4 + size
        (size,) = struct.unpack_from("<Q", head, offset)
    except (struct.error, UnicodeDecodeError) as fault:
        raise DamageError(f"an attachment of {length} bytes ends within its name, or it is not UTF-8") from fault
    end = at + PREFIX + offset + 8 + size
    if end + 4 > at + length:
        raise DamageError("the declared data size of an attachment exceeds its record")
    stated = int.from_bytes(file.read(end, 4), "little") if with_crc else 0
    if stated and stated != file.crc(at + PREFIX, end):
        raise DamageError("the checksum of an attachment does not match")
