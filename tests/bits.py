"""Comparison bit by bit, and made-up samples with everything that a log may contain."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

# Whole numbers, so that samples often equal each other, a limit or a grid point; missing and infinite ones.
VALUES = st.one_of(
    st.integers(-4, 4).map(float),
    st.floats(-4.0, 4.0, width=16),
    st.sampled_from([np.nan, np.inf, -np.inf, -0.0, 1e-300, 1e300]),
)
COUNTS = st.sampled_from([0, 1, 2, 3, 4, 9, 30, 60])


def samples(count: int, columns: int = 1, values: st.SearchStrategy[float] = VALUES) -> st.SearchStrategy[Any]:
    """(count, columns) float64."""
    return arrays(np.float64, (count, columns), elements=values, fill=values)


def clocks(count: int) -> st.SearchStrategy[Any]:
    """(count,) s, strictly increasing: regular, with jitter or with gaps, early or late."""
    steps = arrays(np.float64, count, elements=st.sampled_from([1e-3, 1.1e-3, 0.5e-3, 4e-3, 0.3]), fill=st.just(1e-3))
    return st.tuples(st.sampled_from([0.0, -1.0, 1e6]), steps).map(lambda pair: pair[0] + np.cumsum(pair[1]))


def assert_same_bits(ours: Any, theirs: Any) -> None:
    """Equal shape and type, and equal bits except those of a NaN."""
    assert ours.dtype == theirs.dtype and ours.shape == theirs.shape
    np.testing.assert_array_equal(ours, theirs)
    if ours.dtype.kind == "f":
        np.testing.assert_array_equal(np.signbit(ours) & ~np.isnan(ours), np.signbit(theirs) & ~np.isnan(theirs))


def every_value(value: Any) -> str:
    """All values in a result, to compare results that have NaN, or a short `repr`."""
    if is_dataclass(value) and not isinstance(value, type):
        inner = ", ".join(f"{item.name}={every_value(getattr(value, item.name))}" for item in fields(value))
        return f"{type(value).__name__}({inner})"
    if isinstance(value, Mapping):
        return f"{{{', '.join(f'{key!r}: {every_value(item)}' for key, item in value.items())}}}"
    if isinstance(value, Sequence) and not isinstance(value, str):
        return f"[{', '.join(map(every_value, value))}]"
    return repr(value)
