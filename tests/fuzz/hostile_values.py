"""Hostile values and what a mutation makes of a file: of its TOML, JSON, XML or CSV, and of its bytes. Seeded."""

from __future__ import annotations

import datetime
import gzip
import json
import math
import re
from collections.abc import Sequence
from typing import Any

import numpy as np

VALUES: tuple[Any, ...] = (
    *(0, 1, -1, 2, 7, 10**9, 2**31, 2**53 + 1, 2**63 - 1, -(2**63), 10**19, 10**400),
    *(0.0, -0.0, 0.5, -1.5, 1e-320, 1e-30, 1e15, 1e300, -1e308, math.nan, math.inf, -math.inf),
    *(True, False, "", " ", "x", "\0", "a\0b", "a\nb", "\x1b[2J", "\u202e", "*", "**/*", "[", "a.b", ".", "..", "/"),
    *("/dev/zero", "/dev/stdin", "/proc/self/mem", "n" * 5000, "1e400", "nan", "-", "%s%n", "{}", "1 2", "0x10"),
    *([], [[]], [1], [1, "a"], [0.1] * 300, [[1.0, 2.0], [3.0]], ["*"], [None], {}, {"a": 1}, {"": {}}, [{}]),
    datetime.date(2024, 1, 1),
)
TEXTS: tuple[bytes, ...] = (
    *(b"", b"\0", b"\xff\xfe", b"\xef\xbb\xbf", b"nan", b"inf", b"1e400", b"9" * 5000, b"-", b"\r", b"\n\n", b'"'),
    *(b"'", b"'''", b'"""', b"[" * 500, b"{" * 500, b"<" * 50, b"a." * 200, b",,,,", b";", b"\t", b"1 2", b"1,5"),
    *("\u202e\ud7ff".encode(), b"=", b"#", b"\x1b[31m", b"2024-01-01T00:00:00Z", b"1_000", b"0x1F", b"&amp;"),
)


class Mutations:
    """Mutations of files, each by a few draws of `random`."""

    def __init__(self, random: np.random.Generator) -> None:
        self.random = random

    def pick(self, items: Sequence[Any]) -> Any:
        """One of the items."""
        return items[int(self.random.integers(len(items)))]

    def content(self, content: bytes, suffix: str) -> bytes:
        """A file's content, mutated by what it is, or as bytes."""
        if self.random.random() < 0.25:
            return self.raw(content)
        if suffix == ".toml":
            return toml(self.tree(_toml_values(content))).encode("utf-8", "replace")
        if suffix == ".json":
            return json.dumps(self.tree(json.loads(content)), default=str).encode("utf-8", "replace")
        if suffix == ".gz":
            inner = json.dumps(self.tree(json.loads(gzip.decompress(content))), default=str).encode("utf-8", "replace")
            return gzip.compress(inner, 1)
        if suffix == ".urdf":
            return self.xml(content)
        return self.table(content) if suffix == ".csv" else self.raw(content)

    def raw(self, content: bytes) -> bytes:
        """Bytes changed, cut out, put in or repeated."""
        made = bytearray(content)
        for _ in range(int(self.random.integers(1, 4))):
            at = int(self.random.integers(len(made) + 1)) if self.random.random() < 0.7 else 0
            kind = int(self.random.integers(5))
            if kind == 0 and made:
                made[min(at, len(made) - 1)] = int(self.random.integers(256))
            elif kind == 1:
                del made[at : at + int(self.random.integers(1, 60))]
            elif kind == 2:
                made[at:at] = self.pick(TEXTS)
            elif kind == 3:
                del made[at:]
            else:
                made[at:at] = made[at : at + 200]
        return bytes(made)

    def tree(self, values: Any) -> Any:
        """Nested values with one or two of them replaced, removed, repeated or added."""
        for _ in range(int(self.random.integers(1, 3))):
            places = list(_places(values))
            if not places:
                return self.pick(VALUES)
            # Shallow places are few, and matter as much as the many deep ones.
            depth = self.pick(sorted({len(place) for place in places}))
            place = self.pick([item for item in places if len(item) == depth])
            holder = values
            for key in place[:-1]:
                holder = holder[key]
            last, kind = place[-1], self.random.random()
            if kind < 0.7:
                holder[last] = self.pick(VALUES)
            elif kind < 0.85:
                del holder[last]
            elif isinstance(holder, list):
                holder.insert(last, holder[last])
            else:
                holder[self.pick(("new", "", "a b", "x" * 400, "\u202e", str(last) + "s"))] = self.pick(VALUES)
        return values

    def xml(self, content: bytes) -> bytes:
        """A URDF with an attribute or tag replaced or removed, or with elements repeated."""
        text = content.decode()
        found = list(re.finditer(r'[a-z]+="[^"]*"|<[^>]*>', text))
        match = self.pick(found)
        kind = int(self.random.integers(4))
        if kind == 0 and "=" in match[0] and not match[0].startswith("<"):
            name = match[0].partition("=")[0]
            put = f'{name}="{str(self.pick(VALUES)).replace(chr(34), "")}"'
        else:
            put = ("", match[0] * 2, "<link/>", '<joint name="x" type="floating"/>')[kind]
        return (text[: match.start()] + put + text[match.end() :]).encode("utf-8", "replace")

    def table(self, content: bytes) -> bytes:
        """A table with cells replaced, lines repeated or cut."""
        lines = content.split(b"\n")
        for _ in range(int(self.random.integers(1, 4))):
            at = int(self.random.integers(min(len(lines), 3) if self.random.random() < 0.5 else len(lines)))
            cells = lines[at].split(b",")
            column = int(self.random.integers(len(cells)))
            value = self.pick(VALUES)
            text = self.pick(TEXTS) if self.random.random() < 0.4 else str(value).encode("utf-8", "replace")
            if self.random.random() < 0.3:  # a whole column
                lines = [
                    b",".join([*row[:column], text, *row[column + 1 :]])
                    for row in (line.split(b",") for line in lines if line)
                ]
            elif self.random.random() < 0.8:
                cells[column] = text
                lines[at] = b",".join(cells)
            else:
                lines[at : at + 1] = [lines[at]] * int(self.random.integers(0, 4))
                lines = lines or [b""]
        return b"\n".join(lines)


def toml(values: Any, prefix: str = "") -> str:
    """Values as TOML: tables below the root as inline tables."""
    if not isinstance(values, dict):
        return f"value = {_toml_value(values)}\n"
    return "".join(f"{json.dumps(str(key))} = {_toml_value(value)}\n" for key, value in values.items())


def _toml_value(value: Any) -> str:
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{json.dumps(str(key))} = {_toml_value(item)}" for key, item in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(map(_toml_value, value)) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, float):
        return repr(value)
    if value is None:
        return '""'
    return json.dumps(value) if isinstance(value, str) else str(value)


def _toml_values(content: bytes) -> dict[str, Any]:
    import tomllib

    return tomllib.loads(content.decode())


def _places(values: Any, above: tuple[Any, ...] = ()) -> Any:
    keys = values if isinstance(values, dict) else range(min(len(values), 30)) if isinstance(values, list) else ()
    for key in list(keys):
        yield (*above, key)
        if len(above) < 6:
            yield from _places(values[key], (*above, key))
