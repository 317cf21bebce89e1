"""Write ULog files from PX4's specification: https://docs.px4.io/main/en/dev_log/ulog_file_format.html"""

from __future__ import annotations

import struct
from collections.abc import Iterable
from dataclasses import dataclass, field
from pathlib import Path

MAGIC = b"ULog\x01\x12\x35"
SYNC = b"\x2f\x73\x13\x20\x25\x0c\xbb\x12"
CODES = {
    "int8_t": "b",
    "uint8_t": "B",
    "int16_t": "h",
    "uint16_t": "H",
    "int32_t": "i",
    "uint32_t": "I",
    "int64_t": "q",
    "uint64_t": "Q",
    "float": "f",
    "double": "d",
    "bool": "?",
    "char": "c",
}


def message(kind: str, content: bytes) -> bytes:
    """Return a message: its size without the header, its type, its content."""
    return struct.pack("<HB", len(content), ord(kind)) + content


@dataclass
class UlogFile:
    """A ULog file in memory: definitions first, then data, in the order of the calls."""

    start_us: int = 1_000_000
    content: bytes = field(init=False)

    def __post_init__(self) -> None:
        self.content = MAGIC + b"\x01" + struct.pack("<Q", self.start_us) + message("B", bytes(40))

    def add(self, kind: str, content: bytes) -> UlogFile:
        """Append a message of any type."""
        self.content += message(kind, content)
        return self

    def info(self, key: str, value: str) -> UlogFile:
        """Append a text about the log."""
        named = f"char[{len(value.encode())}] {key}".encode()
        return self.add("I", bytes([len(named)]) + named + value.encode())

    def parameter(self, key: str, value: float) -> UlogFile:
        """Append a parameter."""
        named = f"float {key}".encode()
        return self.add("P", bytes([len(named)]) + named + struct.pack("<f", value))

    def format(self, name: str, fields: str) -> UlogFile:
        """Append a definition: `uint64_t timestamp;float[4] q;`."""
        return self.add("F", f"{name}:{fields}".encode())

    def subscribe(self, number: int, name: str, instance: int = 0) -> UlogFile:
        """Append the subscription of an instance of a topic."""
        return self.add("A", struct.pack("<BH", instance, number) + name.encode())

    def data(self, number: int, layout: str, rows: Iterable[tuple]) -> UlogFile:
        """Append messages; `layout` are the struct codes of their values."""
        packer = struct.Struct("<" + layout)
        self.content += b"".join(message("D", struct.pack("<H", number) + packer.pack(*row)) for row in rows)
        return self

    def dropout(self, milliseconds: int) -> UlogFile:
        """Append a dropout."""
        return self.add("O", struct.pack("<H", milliseconds))

    def sync(self) -> UlogFile:
        """Append a synchronisation mark."""
        return self.add("S", SYNC)

    def text(self, stamp_us: int, words: str) -> UlogFile:
        """Append a logged text."""
        return self.add("L", b"6" + struct.pack("<Q", stamp_us) + words.encode())

    def write(self, path: Path) -> Path:
        """Write the file."""
        path.write_bytes(self.content)
        return path
