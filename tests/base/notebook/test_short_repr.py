"""One short line for values with arrays or many rows."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from pathlib import Path

import numpy as np

from cdtool.base.notebook.short_repr import short_repr


class Kind(Enum):
    STIFF = 1


@dataclass(frozen=True)
class Curve:
    time: np.ndarray
    name: str
    kind: Kind = Kind.STIFF
    points: tuple[float, ...] = ()
    by_name: dict[str, float] = field(default_factory=dict)

    __repr__ = short_repr


def test_arrays_are_shown_by_their_size_and_defaults_are_left_out():
    assert repr(Curve(np.zeros((3, 2)), "a")) == "Curve(time=<3 x 2 floats>, name='a')"
    assert repr(Curve(np.zeros(0, np.uint8), "", points=(1.0, 2.5))) == (
        "Curve(time=<0 integers>, name='', points=[1, 2.5])"
    )


def test_many_items_are_counted_and_few_are_shown():
    shown = repr(Curve(np.zeros(1), "a", points=(0.0,) * 7, by_name={"x": 1.0}))
    assert shown == "Curve(time=<1 floats>, name='a', points=<7 items>, by_name={'x'})"


def test_a_default_that_contains_arrays_is_compared_without_an_error():
    @dataclass(frozen=True)
    class Parts:
        parts: tuple[np.ndarray, ...] = (np.zeros(2),)

        __repr__ = short_repr

    assert repr(Parts()).endswith("Parts()") and repr(Parts((np.zeros(2), np.zeros(2)))).endswith("(parts=<2 items>)")


def test_a_long_value_ends_in_dots():
    fields = {f"name_{i}": (str, "") for i in range(30)}
    kind = type("Long", (), {"__annotations__": dict.fromkeys(fields, "str"), "__repr__": short_repr})
    long = dataclass(frozen=True)(kind)(*["a text of some length"] * 30)
    assert len(repr(long)) < 200 and repr(long).endswith(", ...)")


def test_a_long_text_keeps_its_end():
    shown = repr(Curve(np.zeros(1), str(Path("folder") / ("x" * 80) / "03.csv")))
    assert "03.csv'" in shown and len(shown) < 100
