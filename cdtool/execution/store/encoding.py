"""Frozen dataclasses as compact JSON and back, by the types of their fields.

An instance is the list of its field values. Both ends have the same classes: the key of a stored outcome contains the
version of the code. Numbers are exact, NaN and infinity included; an array has the type that its field states.
"""

from __future__ import annotations

import json
import types
from base64 import b64decode, b64encode
from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from functools import cache
from operator import attrgetter
from typing import Any, Literal, NamedTuple, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

from cdtool.base.files.bounded_loading import parse_own_json

T = TypeVar("T")

_PLAIN = (str, int, float, bool, type(None))
_as_json = json.JSONEncoder(separators=(",", ":"), check_circular=False).encode


class _Plan(NamedTuple):
    """How values of a type become JSON values and back; None: they are JSON values."""

    encode: Callable[[Any], Any] | None
    decode: Callable[[Any], Any] | None


def encoded(value: Any, kind: Any) -> str:
    """Return a value of a type as JSON; raises TypeError for a type that has no JSON form."""
    plan = _plan(kind)
    return _as_json(plan.encode(value) if plan.encode else value)


def decoded(text: str | bytes, kind: type[T]) -> T:
    """Return the value of a type that `encoded` made; raises ValueError for anything else."""
    plan = _plan(kind)  # type: ignore[arg-type]  # types are hashable
    try:
        values = parse_own_json(text)
        made: T = plan.decode(values) if plan.decode else values
    except (TypeError, KeyError, IndexError, AttributeError, ImportError) as fault:
        raise ValueError(f"not an encoded {kind.__name__}: {fault}") from fault
    return made


@cache
def _plan(kind: Any) -> _Plan:
    """Return the plan of a type."""
    origin, inner = get_origin(kind), get_args(kind)
    if hasattr(origin, "__value__"):  # a `type` statement: NumPy 2.5 defines NDArray by one
        return _plan(origin.__value__[inner])
    if kind in _PLAIN or origin is Literal:
        return _Plan(None, None)
    if origin in (Union, types.UnionType):
        return _optional([item for item in inner if item is not type(None)])
    if origin is tuple:
        return _sequence(inner[0]) if len(inner) == 2 and inner[1] is Ellipsis else _fixed(inner)
    if origin is Mapping:
        return _mapping(inner[1])
    if origin is np.ndarray:
        return _array(np.dtype(get_args(inner[1])[0]).newbyteorder("<"))
    if kind is Any:  # the numbers of a finding: JSON values and tuples
        return _Plan(lambda value: value, _with_tuples)
    if is_dataclass(kind):
        return _record(kind)  # type: ignore[arg-type]  # a class, not an instance
    raise TypeError(f"{kind} has no JSON form")


def _array(dtype: np.dtype[Any]) -> _Plan:
    def encode(array: Any) -> list[Any]:
        raw = np.ascontiguousarray(array, dtype=dtype).tobytes()
        return [list(array.shape), b64encode(raw).decode("ascii")]

    def decode(values: list[Any]) -> Any:
        shape, text = values
        return np.frombuffer(b64decode(text, validate=True), dtype=dtype).reshape(shape)

    return _Plan(encode, decode)


def _optional(inner: list[Any]) -> _Plan:
    if len(inner) > 1:
        if all(item in _PLAIN for item in inner):
            return _Plan(None, None)
        raise TypeError(f"{inner} have no common JSON form")
    encode, decode = _plan(inner[0])
    if encode is None or decode is None:
        return _Plan(None, None)
    return _Plan(
        lambda value: None if value is None else encode(value), lambda value: None if value is None else decode(value)
    )


def _sequence(inner: Any) -> _Plan:
    encode, decode = _plan(inner)
    if encode is None or decode is None:
        return _Plan(list, tuple)
    return _Plan(lambda items: [encode(item) for item in items], lambda items: tuple([decode(item) for item in items]))


def _fixed(inner: tuple[Any, ...]) -> _Plan:
    plans = [_plan(item) for item in inner]

    def encode(items: tuple[Any, ...]) -> list[Any]:
        return [plan.encode(item) if plan.encode else item for plan, item in zip(plans, items, strict=True)]

    def decode(items: list[Any]) -> tuple[Any, ...]:
        return tuple([plan.decode(item) if plan.decode else item for plan, item in zip(plans, items, strict=True)])

    return _Plan(encode, decode)


def _mapping(inner: Any) -> _Plan:
    encode, decode = _plan(inner)
    if encode is None or decode is None:
        return _Plan(dict, None)
    return _Plan(
        lambda items: {name: encode(item) for name, item in items.items()},
        lambda items: {name: decode(item) for name, item in items.items()},
    )


def _record(kind: type[Any]) -> _Plan:
    hints = get_type_hints(kind)
    names = tuple(item.name for item in fields(kind))
    plans = [(place, _plan(hints[name])) for place, name in enumerate(names)]
    special = [(place, plan.encode, plan.decode) for place, plan in plans if plan.encode is not None]
    read = attrgetter(*names) if len(names) > 1 else lambda value: (getattr(value, names[0]),)

    def encode(value: Any) -> list[Any]:
        values = list(read(value))
        for place, one, _ in special:
            values[place] = one(values[place])
        return values

    def decode(values: list[Any]) -> Any:
        for place, _, one in special:
            if one is not None:
                values[place] = one(values[place])
        return kind(*values)

    return _Plan(encode, decode)


def _with_tuples(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _with_tuples(item) for name, item in value.items()}
    return tuple([_with_tuples(item) for item in value]) if isinstance(value, list) else value
