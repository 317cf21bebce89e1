"""Dataclasses as JSON values and back: the same values, or the place of a mistake."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Generic, Literal, TypeVar

import numpy as np
import numpy.typing as npt
import pytest

from cdtool.base.files import typed_json
from cdtool.base.files.typed_json import decoded, encoded, plain, typed

Item = TypeVar("Item", bound=np.generic)


@dataclass(frozen=True)
class Counts:
    numbers: npt.NDArray[np.int64]


class Alias:
    """`type NDArray[Item] = ...`, a statement of Python 3.12 that NumPy 2.5 uses."""

    __value__ = np.ndarray[tuple[int, ...], np.dtype[Item]]


class Subscripted(Generic[Item]):
    """What `get_origin` and `get_args` see of `Alias[np.int64]`."""


@dataclass(frozen=True, slots=True)
class Step:
    name: str
    peak: float | None = None


@dataclass(frozen=True, slots=True)
class Row:
    """A field of every form but an array."""

    steps: tuple[Step, ...]
    side: Literal["above", "below"] | None
    shares: Mapping[str, float]
    span: tuple[float, int]
    clipped: bool
    anything: Any
    numbers: Mapping[str, Annotated[Any, tuple]]


ROW = Row(
    (Step("first", 1.5), Step("second")),
    "above",
    {"gap": 0.25},
    (-math.inf, 3),
    False,
    {"a": [1, None]},
    {"a": (1, (2,))},
)


def test_what_is_read_is_what_was_written():
    assert decoded(encoded(ROW, Row), Row) == ROW
    (read,) = decoded(encoded((Step("nan", math.nan),), tuple[Step, ...]), tuple[Step, ...])
    assert math.isnan(read.peak) and read.name is sys.intern("nan")
    assert typed(Step, {"name": "first", "peak": 1}, "step") == Step("first", 1.0)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"steps": 3}, "row.steps is not a list"),
        ({"steps": [{"name": "a"}, {"name": 1}]}, "row.steps[1].name is 1, not a text"),
        ({"steps": [{"peak": 1.0}]}, "row.steps[0]: name missing"),
        ({"side": "left"}, "row.side is 'left', not one of above, below"),
        ({"side": 1}, "row.side is 1, not a text"),
        ({"shares": {"gap": "much"}}, 'row.shares is "much", not a number'),
        ({"span": [1.0]}, "row.span is not a list of 2 values"),
        ({"clipped": 0}, "row.clipped is 0, not true or false"),
        ({"cliped": 0}, "row has an unknown field 'cliped'"),
    ],
)
def test_a_mistake_is_named_with_its_place(change, words):
    with pytest.raises(ValueError, match=f"^{re.escape(words)}$"):
        typed(Row, {**plain(ROW), **change}, "row")


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
