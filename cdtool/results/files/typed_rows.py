"""Dataclasses from the values of a JSON file, checked field by field."""

from __future__ import annotations

import json
import types
from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields, is_dataclass
from functools import cache
from typing import Any, TypeVar, Union, get_args, get_origin, get_type_hints

from cdtool.results.results import ConclusionResult, ContactResult, LimitResult

Row = TypeVar("Row")
_PLAIN = {float: "a number", int: "a whole number", str: "a text", bool: "true or false"}
# The possible values of a text field: of one class, or of every class that has the field.
WORDS: Mapping[tuple[type, str] | str, tuple[str, ...]] = {
    (ContactResult, "outcome"): ("detected", "missed", "not_assessable", "in_progress"),
    (LimitResult, "outcome"): ("met", "violated", "not_assessable"),
    (ConclusionResult, "outcome"): ("violated", "not_assessable", "met", "not_asked"),
    "verdict": ("pass", "fail", "not_assessable"),
    "side": ("above", "below"),
    "severity": ("loss", "warning", "note"),
}


def build(kind: type[Row], values: Any, where: str) -> Row:
    """Return a dataclass from JSON values, checked field by field; raises ValueError that names the field."""
    if not isinstance(values, dict):
        raise ValueError(f"{where} is not an object")
    known = _field_types(kind)  # type: ignore[arg-type]
    for name in values:
        if name not in known:
            raise ValueError(f"{where} has an unknown field '{name}'")
    missing = [name for name in _required(kind) if name not in values]  # type: ignore[arg-type]
    if missing:
        raise ValueError(f"{where}: {', '.join(missing)} missing")
    made = {name: _value(known[name], value, f"{where}.{name}") for name, value in values.items()}
    for name, value in made.items():
        words = WORDS.get((kind, name)) or WORDS.get(name)
        if words and value is not None and value not in words:
            raise ValueError(f"{where}.{name} is '{value}', not one of {', '.join(words)}")
    return kind(**made)


def _value(kind: Any, value: Any, where: str) -> Any:
    origin = get_origin(kind)
    if origin in (Union, types.UnionType):
        if value is None:
            return None
        kind = next(item for item in get_args(kind) if item is not type(None))
        return _value(kind, value, where)
    if origin in (tuple, Sequence):
        if not isinstance(value, list):
            raise ValueError(f"{where} is not a list")
        item_kind = get_args(kind)[0]
        return tuple(_value(item_kind, item, f"{where}[{i}]") for i, item in enumerate(value))
    if origin is not None:
        if not isinstance(value, dict):
            raise ValueError(f"{where} is not an object")
        return value
    if is_dataclass(kind):
        return build(kind, value, where)  # type: ignore[arg-type]
    if kind is float and isinstance(value, int) and not isinstance(value, bool):
        return float(value)
    if kind is not Any and (not isinstance(value, kind) or (kind is int and isinstance(value, bool))):
        raise ValueError(f"{where} is {json.dumps(value, ensure_ascii=False)}, not {_PLAIN[kind]}")
    return value


@cache
def _field_types(kind: Any) -> Mapping[str, Any]:
    hints = get_type_hints(kind)
    return {item.name: hints[item.name] for item in fields(kind)}


@cache
def _required(kind: Any) -> tuple[str, ...]:
    return tuple(item.name for item in fields(kind) if item.default is MISSING and item.default_factory is MISSING)
