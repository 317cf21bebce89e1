"""The shape of a JSON message: the text that messages of one shape share, and the indices of a field's values.

Every number, true and false of one message is replaced by its index among the values (0, 1, 2, ...). Python's json
module reads that text into an object with indices instead of numbers. The field language, applied to this object,
returns a field's indices in all messages of the shape; JSON needs no rules of its own.
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
    """A field in all messages of a shape: the `indices` of its values, where -1 is NaN.

    Without indices the field is absent for the reason `fault`, belongs to other joints, or is NaN or an empty array.
    """

    indices: tuple[int, ...]
    other_joints: bool = False
    fault: FieldMissingError | None = None


@dataclass
class JsonShape:
    """The shape of JSON messages; `content` is the object read by Python, with indices in place of values."""

    literals: ByteArray
    tokens: IntArray
    content: dict[str, Any]
    _resolved: dict[tuple[Field, tuple[str, ...]], Resolved] = field(default_factory=dict)

    def resolve(self, wanted: Field, joints: Sequence[str]) -> Resolved:
        """Return the indices of a field's values."""
        key = wanted, tuple(joints)
        if key not in self._resolved:
            self._resolved[key] = _resolve(self.content, wanted, joints)
        return self._resolved[key]

    def stamp(self) -> tuple[int, int] | None:
        """Return the indices of the header stamp's seconds and nanoseconds; None if they are not numbers."""
        for names in STAMPS:
            pair = tuple(self._member("header", "stamp", name) for name in names)
            if all(value is not None for value in pair):
                return pair if all(isinstance(index, int) for index in pair) else None
        return None

    def has_stamp(self) -> bool:
        """Return True if the header has a stamp, of whatever type."""
        return self._member("header", "stamp") is not None

    def _member(self, *names: str) -> Any:
        value: Any = self.content
        for name in names:
            value = value.get(name) if isinstance(value, dict) else None
        return value

    def fields(self) -> list[str]:
        """Return the numeric fields."""
        return list(numeric_fields(self.content))

    def read(
        self, data: ByteArray, start: IntArray, length: IntArray, indices: IntArray
    ) -> tuple[ByteArray, npt.NDArray[np.float64]]:
        """Return which messages match (n,), as codes of the kernel, and their values with `indices` (n, k)."""
        tokens = self.tokens_with(indices)
        bits = np.empty((len(start), len(indices)), dtype=np.uint64)
        matches = np.empty(len(start), dtype=np.uint8)
        kernel.read_matching(data, start, length, self.literals, tokens, powers_of_five(), bits, matches)
        return matches, bits.view(np.float64)

    def tokens_with(self, indices: IntArray) -> IntArray:
        """Return the tokens with columns for the values with these indices."""
        tokens = self.tokens.copy()
        values = np.flatnonzero(tokens[:, 2] == kernel.VALUE)
        tokens[values[indices], 3] = np.arange(len(indices))
        return tokens


def learn_shape(content: bytes) -> JsonShape | None:
    """Return the shape of a JSON message; None if it has too many tokens or an infinite number."""
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
    # The kernel reads whole words.
    return JsonShape(np.frombuffer(bytes(literals) + bytes(8), dtype=np.uint8).copy(), tokens, shape)


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
        return Resolved(tuple(-1 if math.isnan(index) else int(index) for index in value))
    return Resolved(() if math.isnan(value) else (int(value),))
