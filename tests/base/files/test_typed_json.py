"""Dataclasses as JSON values and back: the same values, or the place of a mistake."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
import pytest

from cdtool.base.files.typed_json import decoded, encoded, plain, typed


@dataclass(frozen=True)
class Counts:
    numbers: npt.NDArray[np.int64]


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


ROW = Row(
    (Step("first", 1.5), Step("second")),
    "above",
    {"gap": 0.25},
    (-math.inf, 3),
    False,
    {"a": [1, None]},
)


def test_what_is_read_is_what_was_written():
    assert decoded(encoded(ROW), Row) == ROW
    (read,) = decoded(encoded((Step("nan", math.nan),)), tuple[Step, ...])
    assert math.isnan(read.peak) and read.name is sys.intern("nan")
    assert typed(Step, {"name": "first", "peak": 1}, "step") == Step("first", 1.0)
    assert plain(Step("numpy", np.float64(2.5))) == {"name": "numpy", "peak": 2.5}


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"steps": 3}, "row.steps: expected a list, got a whole number"),
        ({"steps": [{"name": "a"}, {"name": 1}]}, "row.steps[1].name: expected a text, got a whole number"),
        ({"steps": [{"peak": 1.0}]}, "row.steps[0]: object missing required field `name`"),
        ({"side": "left"}, "row.side: invalid enum value 'left'"),
        ({"shares": {"gap": "much"}}, "row.shares[...]: expected a number, got a text"),
        ({"span": [1.0]}, "row.span: expected a list of length 2, got 1"),
        ({"clipped": 0}, "row.clipped: expected true or false, got a whole number"),
    ],
)
def test_a_mistake_is_named_with_its_place(change, words):
    with pytest.raises(ValueError, match=f"^{re.escape(words)}$"):
        typed(Row, {**plain(ROW), **change}, "row")


def test_arrays_come_back_with_their_type():
    made = decoded(encoded(Counts(np.array([1, -(2**62)]))), Counts)
    assert made.numbers.dtype == np.int64 and made.numbers.tolist() == [1, -(2**62)]


@pytest.mark.parametrize("wrong", [["x"], [None], "AAAA", [2**70]])
def test_an_array_of_anything_else_is_refused_with_its_place(wrong):
    with pytest.raises(ValueError, match=r"^counts\.numbers: "):
        typed(Counts, {"numbers": wrong}, "counts")


def test_a_type_without_a_json_form_is_refused():
    with pytest.raises(TypeError, match="has no JSON form"):
        encoded(1j)
