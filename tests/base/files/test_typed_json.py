"""Arrays in the store, whichever way NumPy defines the type of their fields."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
import numpy.typing as npt
import pytest

from cdtool.base.files import typed_json
from cdtool.base.files.typed_json import decoded, encoded

Item = TypeVar("Item", bound=np.generic)


@dataclass(frozen=True)
class Counts:
    numbers: npt.NDArray[np.int64]


class Alias:
    """`type NDArray[Item] = ...`, a statement of Python 3.12 that NumPy 2.5 uses."""

    __value__ = np.ndarray[tuple[int, ...], np.dtype[Item]]


class Subscripted(Generic[Item]):
    """What `get_origin` and `get_args` see of `Alias[np.int64]`."""


def test_arrays_come_back_with_their_type():
    made = decoded(encoded(Counts(np.array([1, -(2**62)])), Counts), Counts)
    assert made.numbers.dtype == np.int64 and made.numbers.tolist() == [1, -(2**62)]


def test_an_alias_of_a_type_is_what_it_stands_for(monkeypatch):
    alias = Subscripted[np.int64]
    monkeypatch.setattr(Subscripted, "__value__", Alias.__value__, raising=False)
    form = typed_json._form.__wrapped__(alias)
    assert form.typed(form.plain(np.array([3, 4]))).tolist() == [3, 4]


def test_a_type_without_a_json_form_is_refused():
    with pytest.raises(TypeError, match="has no JSON form"):
        encoded(1j, complex)
