"""Equality of values with arrays: two results of the same logs are equal, also after pickling or copying one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from numbers import Number
from typing import Any

import numpy as np


def same_values(first: Any, second: Any) -> bool:
    """Return whether two values are of the same kind and have the same content; NaN equals NaN.

    Dataclasses are compared field by field, without those with `compare=False`; arrays element by element.

    Examples
    --------
    >>> same_values({"a": np.array([1.0, np.nan])}, {"a": np.array([1.0, np.nan])})
    True
    >>> same_values((np.zeros(2), 1), (np.zeros(3), 1))
    False
    """
    if first is second:
        return True
    if isinstance(first, np.ndarray) or isinstance(second, np.ndarray):
        return _same_arrays(first, second)
    if is_dataclass(first) and not isinstance(first, type):
        return type(first) is type(second) and all(
            same_values(getattr(first, item.name), getattr(second, item.name)) for item in fields(first) if item.compare
        )
    if isinstance(first, Mapping):
        return (
            isinstance(second, Mapping)
            and first.keys() == second.keys()
            and all(same_values(value, second[key]) for key, value in first.items())
        )
    if isinstance(first, Sequence) and not isinstance(first, str | bytes):
        return type(first) is type(second) and len(first) == len(second) and all(map(same_values, first, second))
    return bool(first == second) or (
        isinstance(first, Number | np.generic) and bool(first != first and second != second)
    )


def equal_by_values(self: Any, other: object) -> bool:
    """Return whether two values of a class are the same (see `same_values`): its `__eq__`."""
    return same_values(self, other) if type(self) is type(other) else NotImplemented


def _same_arrays(first: Any, second: Any) -> bool:
    if not (isinstance(first, np.ndarray) and isinstance(second, np.ndarray)):
        return False
    if first.shape != second.shape or first.dtype != second.dtype:
        return False
    return bool(np.array_equal(first, second, equal_nan=first.dtype.kind in "fc"))
