"""Frozen dataclasses as JSON values and back, by the types of their fields.

An instance is an object of its fields, a tuple a list, an array the list of its numbers. `Any` is a JSON
value as it is, `Annotated[Any, tuple]` one whose lists are tuples. Numbers are exact, NaN and infinity included. Equal
texts that are read are one text in memory.
"""

from __future__ import annotations

import json
import types
from collections.abc import Callable, Mapping
from dataclasses import MISSING, fields, is_dataclass
from functools import cache
from sys import intern
from typing import Annotated, Any, Literal, NamedTuple, TypeVar, Union, get_args, get_origin, get_type_hints

import numpy as np

from cdtool.base.files.bounded_loading import parse_own_json

T = TypeVar("T")

_PLAIN = {float: "a number", int: "a whole number", str: "a text", bool: "true or false", type(None): "null"}
_as_json = json.JSONEncoder(separators=(",", ":"), check_circular=False).encode


class _Form(NamedTuple):
    """How a value of a type becomes JSON values (None: it is one), and back.

    `typed` raises ValueError with what is wrong after the name of the value: " is 7, not a text", or ".field is ...".
    """

    plain: Callable[[Any], Any] | None
    typed: Callable[[Any], Any]


def plain(value: Any, kind: Any = None) -> Any:
    """Return a value of a type, its own by default, as JSON values; raises TypeError for a type without that form."""
    form = _form(kind or type(value))  # type: ignore[arg-type]  # types are hashable
    return form.plain(value) if form.plain else value


def typed(kind: type[T], values: Any, where: str) -> T:
    """Return a value of a type from JSON values; raises ValueError that names the place in `where`."""
    try:
        made: T = _form(kind).typed(values)  # type: ignore[arg-type]  # types are hashable
    except ValueError as fault:
        raise ValueError(f"{where}{fault}") from fault
    return made


def encoded(value: Any, kind: Any) -> str:
    """Return a value of a type as compact JSON with NaN and infinity."""
    return _as_json(plain(value, kind))


def decoded(text: str | bytes, kind: type[T]) -> T:
    """Return the value of a type that `encoded` made; raises ValueError for anything else."""
    return typed(kind, parse_own_json(text), kind.__name__)


@cache
def _form(kind: Any) -> _Form:
    """Return the form of a type."""
    origin, inner = get_origin(kind), get_args(kind)
    if hasattr(origin, "__value__"):  # a `type` statement: NumPy 2.5 defines NDArray by one
        return _form(origin.__value__[inner])
    if kind in _PLAIN:
        return _Form(None, _number if kind is float else _plain(kind))
    if kind is Any:
        return _Form(None, lambda value: value)
    if origin in _FORMS:
        return _FORMS[origin](inner)
    if is_dataclass(kind):
        return _record(kind)  # type: ignore[arg-type]  # a class, not an instance
    raise TypeError(f"{kind} has no JSON form")


def _mistaken(value: Any, what: str) -> ValueError:
    return ValueError(f" is {json.dumps(value, ensure_ascii=False)}, not {what}")


def _number(value: Any) -> float:
    if type(value) is not float and type(value) is not int:
        raise _mistaken(value, "a number")
    return float(value)


def _plain(kind: type[Any]) -> Callable[[Any], Any]:
    def typed(value: Any) -> Any:
        if type(value) is not kind:
            raise _mistaken(value, _PLAIN[kind])
        return intern(value) if kind is str else value

    return typed


def _word(known: tuple[Any, ...]) -> _Form:
    def typed(value: Any) -> Any:
        if type(value) is not str:
            raise _mistaken(value, "a text")
        if value not in known:
            raise ValueError(f" is '{value}', not one of {', '.join(known)}")
        return intern(value)

    return _Form(None, typed)


def _either(inner: tuple[Any, ...]) -> _Form:
    """Return the form of a value that may be missing, or of one of several plain values."""
    known = [item for item in inner if item is not type(None)]
    if len(known) > 1:
        if all(item in _PLAIN for item in known):
            return _Form(None, lambda value: value)
        raise TypeError(f"{known} have no common JSON form")
    encode, decode = _form(known[0])
    return _Form(
        encode and (lambda value: None if value is None else encode(value)),
        lambda value: None if value is None else decode(value),
    )


def _sequence(inner: tuple[Any, ...]) -> _Form:
    if len(inner) != 2 or inner[1] is not Ellipsis:
        return _fixed(inner)
    encode, decode = _form(inner[0])

    def typed(values: Any) -> tuple[Any, ...]:
        if not isinstance(values, list):
            raise ValueError(" is not a list")
        made: list[Any] = []
        try:
            for value in values:
                made.append(decode(value))
        except ValueError as fault:
            raise ValueError(f"[{len(made)}]{fault}") from fault
        return tuple(made)

    return _Form((lambda items: [encode(item) for item in items]) if encode else list, typed)


def _fixed(inner: tuple[Any, ...]) -> _Form:
    forms = [_form(item) for item in inner]

    def typed(values: Any) -> tuple[Any, ...]:
        if not isinstance(values, list) or len(values) != len(forms):
            raise ValueError(f" is not a list of {len(forms)} values")
        return tuple([form.typed(value) for form, value in zip(forms, values, strict=True)])

    return _Form(
        lambda items: [form.plain(item) if form.plain else item for form, item in zip(forms, items, strict=True)], typed
    )


def _mapping(inner: tuple[Any, ...]) -> _Form:
    encode, decode = _form(inner[1])

    def typed(values: Any) -> dict[str, Any]:
        if not isinstance(values, dict):
            raise ValueError(" is not an object")
        return {name: decode(value) for name, value in values.items()}

    return _Form((lambda items: {name: encode(item) for name, item in items.items()}) if encode else dict, typed)


def _array(inner: tuple[Any, ...]) -> _Form:
    dtype = np.dtype(get_args(inner[1])[0])

    def typed(values: Any) -> Any:
        if not isinstance(values, list):
            raise ValueError(" is not a list")
        try:
            return np.array(values, dtype=dtype)
        except (TypeError, ValueError, OverflowError) as fault:
            raise ValueError(f" is not an array: {fault}") from fault

    return _Form(lambda array: array.tolist(), typed)


def _record(kind: type[Any]) -> _Form:
    hints = get_type_hints(kind, include_extras=True)
    forms = {item.name: _form(hints[item.name]) for item in fields(kind)}
    required = [item.name for item in fields(kind) if item.default is MISSING and item.default_factory is MISSING]
    encoders = [(name, form.plain) for name, form in forms.items() if form.plain]
    decoders = {name: form.typed for name, form in forms.items()}

    def encode(value: Any) -> dict[str, Any]:
        values = {name: getattr(value, name) for name in forms}
        for name, one in encoders:
            values[name] = one(values[name])
        return values

    def typed(values: Any) -> Any:
        if not isinstance(values, dict):
            raise ValueError(" is not an object")
        if values.keys() != decoders.keys():
            if unknown := values.keys() - decoders.keys():
                raise ValueError(f" has an unknown field '{min(unknown)}'")
            if missing := [name for name in required if name not in values]:
                raise ValueError(f": {', '.join(missing)} missing")
        made = {}
        for name, value in values.items():
            try:
                made[name] = decoders[name](value)
            except ValueError as fault:
                raise ValueError(f".{name}{fault}") from fault
        return kind(**made)

    return _Form(encode, typed)


def _with_tuples(value: Any) -> Any:
    if isinstance(value, dict):
        return {name: _with_tuples(item) for name, item in value.items()}
    return tuple([_with_tuples(item) for item in value]) if isinstance(value, list) else value


_FORMS: Mapping[Any, Callable[[tuple[Any, ...]], _Form]] = {
    Literal: _word,
    Union: _either,
    types.UnionType: _either,
    tuple: _sequence,
    Mapping: _mapping,
    np.ndarray: _array,
    Annotated: lambda _: _Form(None, _with_tuples),
}
