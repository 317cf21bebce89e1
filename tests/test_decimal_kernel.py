"""The nearest float64 to a decimal number, bit for bit as Python's float()."""

from __future__ import annotations

import math
import struct

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from cdtool.decimal_kernel import LARGEST, SMALLEST, UNDECIDED, as_float, float_bits, powers_of_five, product

WORDS = st.integers(0, 2**64 - 1)


def _bits(value: float) -> int:
    return int(struct.unpack("<Q", struct.pack("<d", value))[0])


@settings(deadline=None)  # the first call may compile
@given(a=WORDS, b=WORDS)
@example(a=2**64 - 1, b=2**64 - 1)
def test_a_product_of_two_words_has_all_its_bits(a, b):
    upper, lower = product(np.uint64(a), np.uint64(b))
    assert (int(upper) << 64) + int(lower) == a * b


@settings(deadline=None)  # the first call may compile
@given(w=WORDS, q=st.integers(SMALLEST - 10, LARGEST + 10))
@example(w=9007199254740993, q=0)  # exactly between two float64: to the even one
@example(w=9007199254740995, q=0)
@example(w=2**64 - 1, q=-27)
@example(w=22250738585072014, q=-324)  # the smallest normal one
@example(w=17976931348623157, q=292)  # the largest
@example(w=17976931348623159, q=292)
@example(w=0, q=400)
def test_decided_numbers_agree_with_python(w, q):
    bits = float_bits(np.uint64(w), q, powers_of_five())
    if bits != UNDECIDED:
        assert int(bits) == _bits(float(f"{w}e{q}"))


@settings(deadline=None)  # the first call may compile
@given(w=st.integers(1, 2**64 - 1), q=st.integers(-300, 280))
def test_numbers_of_the_usual_size_are_decided(w, q):
    assert float_bits(np.uint64(w), q, powers_of_five()) != UNDECIDED


@pytest.mark.parametrize("text", ["1e-320", "5e-324", "1e309", "1e-343"])
def test_subnormal_and_infinite_numbers_are_left_to_python(text):
    w, q = text.split("e")
    assert float_bits(np.uint64(int(w)), int(q), powers_of_five()) == UNDECIDED


@settings(deadline=None)  # the first call may compile
@given(st.floats(min_value=math.ldexp(1.0, -1022), max_value=1.7976931348623157e308))
def test_bits_are_converted_to_their_number(value):
    assert as_float(np.uint64(_bits(value))) == value
