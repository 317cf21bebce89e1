"""Write the inputs that fuzzing begins with: `python -m tests.fuzz.seed_corpus FOLDER` makes one folder a target."""

from __future__ import annotations

import struct
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from tests.formats import csv_cases
from tests.formats.mcap_damage import logs
from tests.formats.mcap_damage.assembly import assemble, blocks_of
from tests.formats.mcap_damage.generator import cases
from tests.formats.mcap_damage.messages import DEFINITIONS, ordinary
from tests.formats.mcap_damage.payloads import PROTOBUF_SCHEMA
from tests.fuzz.targets import SEPARATOR

_JSON = (
    b'{"x": 1.5, "y": [1, 2], "z": {"a": null}}',
    b'{"x": -1e-5}',
    b' {"\\u0078": 12345678901234567890, "s": "\\n"}',
)


def mcap() -> Iterator[bytes]:
    """Small whole files of every compression, and damaged ones."""
    rng = np.random.default_rng(0)
    for compression in ("", "lz4", "zstd"):
        yield assemble(blocks_of(ordinary(rng, 12), 6, compression))
        yield logs.write(rng, logs.Style(compression), count=12, chunk_size=300).data
    yield logs.write(rng, logs.Style("", chunked=False), count=8).data
    yield from (case.data for case in cases(7, 200) if len(case.data) < 8000)


def messages() -> Iterator[bytes]:
    """Schemas of every encoding with some messages."""
    rng = np.random.default_rng(0)
    written = ordinary(rng, 24)
    known = DEFINITIONS.values()
    schemas = [(0, d.schema_data, d.topic) for d in known if d.encoding == "cdr"]
    schemas += [(1, d.schema_data, d.topic) for d in known if d.encoding == "ros1"]
    for kind, schema, topic in schemas:
        renamed = schema.replace(b"float64 data", b"float64 x").replace(b"float64 value", b"float64 x")
        yield _packed(kind, renamed, [m.payload for m in written if m.topic == topic])
    arrays = b"string[] name\nfloat64[] x\nint8[<=3] b\nfloat32[2] c\nwstring w\nbool[] d"
    body = b"\0\1\0\0" + struct.pack("<I", 1) + struct.pack("<I2s2x", 2, b"a\0") + struct.pack("<I4xd", 1, 2.5)
    yield _packed(0, arrays, [body + struct.pack("<Ib3xff", 1, 3, 1.0, 2.0) + bytes(12)])
    number = b"\x09" + struct.pack("<d", 0.5) + b"\x10\x05"
    yield _packed(2, PROTOBUF_SCHEMA.replace(b"data", b"xxxx"), [number, number[:9], b"\x10\xff\xff\x03", b""])
    yield _packed(3, b"", list(_JSON))


def csv() -> Iterator[bytes]:
    """Awkward tables."""
    yield from (case.content for case in csv_cases.cases(0))


def write(folder: Path) -> None:
    """All of them, numbered."""
    for make in (mcap, messages, csv):
        (folder / make.__name__).mkdir(parents=True, exist_ok=True)
        for number, data in enumerate(make()):
            (folder / make.__name__ / f"{number:04}").write_bytes(data)


def _packed(kind: int, schema: bytes, payloads: list[bytes]) -> bytes:
    return bytes([kind]) + SEPARATOR.join([schema, *payloads])


if __name__ == "__main__":
    write(Path(sys.argv[1]))
