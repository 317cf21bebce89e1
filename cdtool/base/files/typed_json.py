"""Frozen dataclasses as JSON values and back, by the types of their fields.

An instance is an object of its fields, a tuple a list, an array the list of its numbers. Numbers are exact, NaN and
infinity included.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any, TypeVar, get_args

import msgspec
import numpy as np

from cdtool.base.files.bounded_loading import parse_own_json

T = TypeVar("T")

# What msgspec calls the types of JSON values.
_WORDS = {
    "`float`": "a number",
    "`int`": "a whole number",
    "`str`": "a text",
    "`bool`": "true or false",
    "`array`": "a list",
    "`object`": "an object",
    "`float | null`": "a number or null",
    "`int | null`": "a whole number or null",
    "`str | null`": "a text or null",
}
_as_json = json.JSONEncoder(separators=(",", ":"), check_circular=False).encode


def plain(value: Any) -> Any:
    """Return a value as JSON values; raises TypeError for a type without that form."""
    return msgspec.to_builtins(value, enc_hook=_plain)


def typed(kind: type[T], values: Any, where: str) -> T:
    """Return a value of a type from JSON values; raises ValueError that names the place in `where`."""
    try:
        return msgspec.convert(values, kind, dec_hook=_array)
    except msgspec.ValidationError as fault:
        what, _, place = str(fault).partition(" - at `$")
        for name, words in _WORDS.items():
            what = what.replace(name, words)
        raise ValueError(f"{where}{place.rstrip('`')}: {what[0].lower()}{what[1:]}") from fault


def encoded(value: Any) -> str:
    """Return a value as compact JSON with NaN and infinity."""
    return _as_json(plain(value))


def decoded(text: str | bytes, kind: type[T]) -> T:
    """Return the value of a type that `encoded` made; raises ValueError for anything else."""
    return typed(kind, parse_own_json(text), kind.__name__)


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, Mapping):
        return dict(value)
    raise TypeError(f"{type(value)} has no JSON form")


def _array(kind: Any, values: Any) -> Any:
    """Return an array of a type `NDArray[...]`; msgspec adds the place to what this raises."""
    try:
        return np.array(values, dtype=get_args(get_args(kind)[1])[0])
    except OverflowError as fault:
        raise ValueError(f"is not an array: {fault}") from fault
