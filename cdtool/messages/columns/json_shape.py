"""The shape of a JSON message: what other messages must share to be read alike, and where in it a field's values stand.

Every number, true and false of one message is replaced by its place in the row of values (0, 1, 2, ...). What Python's
json makes of that text holds places instead of numbers, and the field language, applied to it, tells a field's places
in all messages of the shape: there are no second rules for JSON.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from cdtool.decimal_kernel import powers_of_five
from cdtool.messages.columns import json_kernel as kernel
from cdtool.messages.columns.decoded_batch import ByteArray, IntArray
from cdtool.messages.fields import STAMPS, Field, FieldMissingError, numeric_fields

_TOKEN = re.compile(rb'"((?:[^"\\]|\\.)*)"\s*(:)?|(-?\d[\d.eE+-]*|true|false)|[^"\d\-tf]+|.', re.DOTALL)
_MOST_TOKENS = 20_000


@dataclass(frozen=True)
class Resolved:
    """A field in all messages of a shape: the `places` of its values, -1 being NaN.

    Without places it is absent for the reason `fault`, or belongs to other joints, or is NaN or an empty array.
    """

    places: tuple[int, ...]
    other_joints: bool = False
    fault: FieldMissingError | None = None


@dataclass
class JsonPattern:
    """Messages of one shape; `content` is what Python's json reads, with the place of each value instead of it."""

    literals: ByteArray
    tokens: IntArray
    content: dict[str, Any]
    _resolved: dict[tuple[Field, tuple[str, ...]], Resolved] = field(default_factory=dict)

    def resolve(self, wanted: Field, joints: Sequence[str]) -> Resolved:
        """Where the field's values stand."""
        key = wanted, tuple(joints)
        if key not in self._resolved:
            self._resolved[key] = _resolve(self.content, wanted, joints)
        return self._resolved[key]

    def stamp(self) -> tuple[int, int] | None:
        """The places of the header stamp's seconds and nanoseconds; None where they are not numbers."""
        for names in STAMPS:
            pair = tuple(self._member("header", "stamp", name) for name in names)
            if all(value is not None for value in pair):
                return pair if all(isinstance(place, int) for place in pair) else None
        return None

    def has_stamp(self) -> bool:
        """True if the header has a stamp, of whatever kind."""
        return self._member("header", "stamp") is not None

    def _member(self, *names: str) -> Any:
        value: Any = self.content
        for name in names:
            value = value.get(name) if isinstance(value, dict) else None
        return value

    def fields(self) -> list[str]:
        """The numeric fields."""
        return list(numeric_fields(self.content))

    def read(
        self, data: ByteArray, start: IntArray, length: IntArray, places: IntArray
    ) -> tuple[ByteArray, npt.NDArray[np.float64]]:
        """Which messages fit (n,), as the kernel says it, and their values at `places` (n, k)."""
        tokens = self.tokens.copy()
        values = np.flatnonzero(tokens[:, 2] == kernel.VALUE)
        tokens[values[places], 3] = np.arange(len(places))
        bits = np.empty((len(start), len(places)), dtype=np.uint64)
        fits = np.empty(len(start), dtype=np.uint8)
        words = np.ndarray((max(0, len(data) - 7),), np.uint64, data, strides=(1,))
        kernel.read_alike(data, words, start, length, self.literals, tokens, powers_of_five(), bits, fits)
        return fits, bits.view(np.float64)


def pattern_of(content: bytes) -> JsonPattern | None:
    """The shape of a message that Python's json reads; None where it has none that others could share."""
    literals, pending, rebuilt = bytearray(), bytearray(), bytearray()
    rows: list[tuple[int, int, int, int]] = []
    values = 0

    def close(kind: int) -> None:
        rows.append((len(literals), len(pending), kind, -1))
        literals.extend(pending)
        pending.clear()

    before = b""
    for token in _TOKEN.finditer(content):
        text = token[0]
        if token[3] is not None:
            close(kernel.VALUE)
            rebuilt += b"%d" % values
            values += 1
        elif (
            token[1] is not None
            and token[2] is None
            and before == b":"
            and b"\\" not in token[1]
            and token[1].isascii()
        ):
            pending += b'"'
            close(kernel.TEXT)
            pending += text[1 + len(token[1]) :]
            rebuilt += text
        else:
            pending += text
            rebuilt += text
        before = text.strip()[-1:] or before
        if len(rows) > _MOST_TOKENS:
            return None
    close(kernel.END)
    try:
        shape = json.loads(bytes(rebuilt), parse_constant=_not_a_number)
    except (ValueError, RecursionError):
        return None
    tokens = np.array(rows, dtype=np.int64).reshape(-1, 4)
    return JsonPattern(np.frombuffer(bytes(literals), dtype=np.uint8).copy(), tokens, shape)


def _not_a_number(name: str) -> float:
    if name != "NaN":
        raise ValueError("infinite")
    return math.nan


def _resolve(content: dict[str, Any], wanted: Field, joints: Sequence[str]) -> Resolved:
    try:
        value = wanted.of(content, joints)
    except FieldMissingError as fault:
        return Resolved((), fault=fault)
    if value is None:
        return Resolved((), other_joints=True)
    if isinstance(value, list):
        return Resolved(tuple(-1 if math.isnan(place) else int(place) for place in value))
    return Resolved(() if math.isnan(value) else (int(value),))
