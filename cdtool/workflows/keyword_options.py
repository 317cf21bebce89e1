"""Turn a function of an options value into one of keywords: the Python API."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from functools import wraps
from typing import Any, Concatenate, ParamSpec, TypeVar, overload

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
    *others, _ = inspect.signature(run).parameters.values()
    signature = inspect.Signature([*others, *inspect.signature(options).parameters.values()])

    @wraps(run)
    def call(*values: Any, **named: Any) -> Any:
        given = signature.bind(*values, **named).arguments
        return run(*(given.pop(other.name) for other in others), options(**given))

    vars(call)["__signature__"] = signature
    return call
