"""How long a record is (section "Records": opcode, length of the content, content), as far as that can be believed."""

from __future__ import annotations

from cdtool.formats.mcap.container.damage import DamageError
from cdtool.formats.mcap.container.records import PREFIX

NO_KIND = "a record of kind 0, which there is not"


def record_length(at: int, head: memoryview, size: int) -> int:
    """Length of the record at byte `at`, prefix included, in a file of `size` bytes; raises DamageError."""
    left = size - at - PREFIX
    if left < 0:
        raise DamageError(f"the file ends within a record: {left + PREFIX} bytes are left")
    length = int.from_bytes(head[1:PREFIX], "little")
    if head[0] == 0:
        raise DamageError(NO_KIND)
    if length > left:
        raise DamageError(f"a record claims {length} bytes where {left} are left")
    return PREFIX + length
