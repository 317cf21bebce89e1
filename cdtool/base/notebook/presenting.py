"""Turn a workflow's function into one that returns its result as a notebook shows it."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from functools import wraps
from typing import TYPE_CHECKING, Any, ParamSpec, TypeVar

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_Given = ParamSpec("_Given")
_Plain = TypeVar("_Plain")
_Shown = TypeVar("_Shown")


def described(figure: Figure, description: str) -> Figure:
    """Return a figure with a description for readers who do not see it."""
    figure.description = description  # type: ignore[attr-defined]
    return figure


def presented(
    run: Callable[_Given, _Plain], show: Callable[[_Plain], _Shown], returns: str
) -> Callable[_Given, _Shown]:
    """Return a function with the parameters of `run` whose result is what `show` makes of it.

    Its docstring is that of `run` with `returns` as the section Returns.
    """

    @wraps(run)
    def call(*values: _Given.args, **named: _Given.kwargs) -> _Shown:
        return show(run(*values, **named))

    text = inspect.getdoc(run) or ""
    made: Any = call
    made.__doc__ = re.sub(r"(?<=^Returns\n-------\n)(?:.+\n)*", lambda _: f"{returns}\n", text, count=1, flags=re.M)
    return call
