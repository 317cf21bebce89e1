"""Digests of what determines an outcome: equal for equal values, different for any other."""

from dataclasses import dataclass, replace
from enum import Enum
from pathlib import PurePosixPath

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cdtool.detectors import DETECTORS
from cdtool.execution.store.digest import combined, digest_of

values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False) | st.text(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
    max_leaves=8,
)


class Side(Enum):
    LEFT = 1
    RIGHT = 2


@dataclass(frozen=True)
class Gains:
    bandwidth: float = 1.0
    curve: np.ndarray | None = None


@dataclass(frozen=True)
class Others:
    bandwidth: float = 1.0
    curve: np.ndarray | None = None


class Plain:
    def __init__(self, size: int) -> None:
        self.size = size


@given(values, values)
def test_only_equal_values_have_one_digest(one, other):
    """True, 1 and 1.0 are equal in Python; a setting may mean something else by each."""
    assert (digest_of(one) == digest_of(other)) == (repr(one) == repr(other))


@pytest.mark.parametrize(
    ("one", "other"),
    [
        (Gains(), Others()),
        (Gains(1.0), Gains(1.5)),
        (Gains(curve=np.zeros(3)), Gains(curve=np.zeros((3, 1)))),
        (Gains(curve=np.zeros(3)), Gains(curve=np.zeros(3, dtype=np.float32))),
        (Side.LEFT, Side.RIGHT),
        (Plain(1), Plain(2)),
        (["ab", "c"], ["a", "bc"]),
        ({"a": 1, "b": 2}, {"b": 2, "a": 1}),
        (PurePosixPath("a/b"), PurePosixPath("a/c")),
        (float("nan"), float("inf")),
        (b"a", b"b"),
    ],
)
def test_these_differ(one, other):
    assert digest_of(one) != digest_of(other)
    assert digest_of(one) == digest_of(one)


def test_a_set_has_one_digest_whatever_its_order():
    assert digest_of({"a", "b", "c"}) == digest_of({"c", "b", "a"})


def test_a_function_has_no_digest():
    with pytest.raises(TypeError, match="has no digest"):
        digest_of([1, len])


def test_digests_are_combined_with_their_borders():
    assert combined("ab", "c") != combined("a", "bc")


@pytest.mark.parametrize("name", DETECTORS.names())
def test_every_gain_of_every_detector_is_in_its_digest(name):
    detector = DETECTORS.load(name)()
    for field, value in vars(detector).items():
        if isinstance(value, float) and not isinstance(value, bool):
            assert digest_of(replace(detector, **{field: value * 1.01 + 1e-9})) != digest_of(detector), field
