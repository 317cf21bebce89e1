"""Turn a function of an options value into one of keywords: the Python API."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from functools import wraps
from typing import Any, Concatenate, ParamSpec, TypeVar, overload

from cdtool.base.errors import nearest

_Given = ParamSpec("_Given")
_First = TypeVar("_First")
_Options = TypeVar("_Options")
_Result = TypeVar("_Result")


@overload
def by_keywords(
    options: Callable[_Given, _Options], run: Callable[[_Options], _Result]
) -> Callable[_Given, _Result]: ...


@overload
def by_keywords(
    options: Callable[_Given, _Options], run: Callable[[_First, _Options], _Result]
) -> Callable[Concatenate[_First, _Given], _Result]: ...


def by_keywords(options: Callable[..., Any], run: Callable[..., Any]) -> Callable[..., Any]:
    """Return `run` as a function of the fields of its options: `detect(log, machine, detector="gm")`.

    The options are the last parameter of `run`; the parameters before it stay. In the docstring, the entry of the
    options is replaced by those of their fields.
    """
    *others, last = inspect.signature(run).parameters.values()
    signature = inspect.Signature([*others, *inspect.signature(options).parameters.values()])

    @wraps(run)
    def call(*values: Any, **named: Any) -> Any:
        for name in named.keys() - signature.parameters.keys():
            raise TypeError(f"no parameter '{name}' ({nearest(name, signature.parameters)})")
        given = signature.bind(*values, **named).arguments
        return run(*(given.pop(other.name) for other in others), options(**given))

    vars(call)["__signature__"] = signature
    call.__doc__ = _with_fields(inspect.getdoc(run) or "", last.name, options)
    return call


def _with_fields(text: str, name: str, options: Callable[..., Any]) -> str:
    """Return a docstring whose entry `name` under Parameters is replaced by the entries of the options' fields."""
    entries: dict[str, str] = {}
    for kind in reversed(inspect.getmro(options) if inspect.isclass(options) else ()):
        entries |= _entries(inspect.cleandoc(vars(kind).get("__doc__") or ""))
    of_fields = "".join(entries.get(field, "") for field in inspect.signature(options).parameters)
    entry = _entries(text).get(name)
    return text.replace(entry, of_fields, 1) if entry and of_fields else text


def _entries(text: str) -> dict[str, str]:
    """Return the entries of the section Parameters of a docstring by name, each with its last line break."""
    section = re.search(r"^Parameters\n-+\n((?:.+\n?)*)", text, re.MULTILINE)
    parts = re.split(r"^(?=\S)", section[1], flags=re.MULTILINE) if section else []
    return {part.partition(" : ")[0]: part if part.endswith("\n") else f"{part}\n" for part in parts if part}
