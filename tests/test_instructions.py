"""Instructions in kernels: prefetch changes nothing at any address; store writes a value only at its address.

load reads eight bytes at any address; equal_bytes and trailing_zeros agree with the same operation in Python.
"""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cdtool.instructions import (
    equal_bytes,
    load,
    prefetch,
    store,
    trailing_zeros,
)
from cdtool.kernels import kernel


@kernel("int64(Array(uint8, 1, 'C', readonly=True), int64)")
def add_up(data, ahead):
    total = 0
    for i in range(len(data)):
        prefetch(data, i + ahead)
        total += data[i]
    return total


def test_addresses_beyond_the_array_are_harmless():
    data = np.arange(200, dtype=np.uint8)
    for ahead in (0, 64, 10**6, 2**62, -(10**9)):
        assert add_up(data, ahead) == data.sum()


def test_the_instruction_is_in_the_machine_code():
    from numba import njit

    namespace = {"prefetch": prefetch.part}
    exec("def touch(data, at):\n    prefetch(data, at)\n", namespace)
    touch = njit("void(uint8[::1], int64)")(namespace["touch"])
    (code,) = touch.inspect_llvm().values()
    assert "llvm.prefetch" in code


@kernel("void(uint64, uint64, float64[::1])")
def put(address, stride, values):
    for i in range(len(values)):
        store(address + np.uint64(i) * stride, values[i])


@kernel("void(uint64, uint64)")
def put_bits(address, bits):
    store(address, bits)


def test_numbers_are_stored_at_their_addresses_and_nowhere_else():
    table = np.zeros((5, 3))
    values = np.array([1.5, -0.0, np.inf, np.nan, 5e-324])
    put(table.ctypes.data + 8, table.strides[0], values)
    assert table[:, 1].tobytes() == values.tobytes()
    assert not table[:, ::2].any()


def test_whole_numbers_are_stored_as_they_are():
    table = np.zeros(2, np.uint64)
    put_bits(table.ctypes.data, 2**64 - 3)
    assert table.tolist() == [2**64 - 3, 0]


@kernel("uint64(Array(uint8, 1, 'C', readonly=True), uint64)")
def word_at(data, at):
    return load(data, at)


@kernel("uint64(Array(uint8, 1, 'C', readonly=True), uint64, int64)")
def places_of(data, at, letter):
    return equal_bytes(data, at, letter)


@kernel("uint64(uint64)")
def zeros_below(word):
    return trailing_zeros(word)


def test_eight_bytes_are_loaded_from_any_address():
    data = np.arange(1, 21, dtype=np.uint8)
    for at in range(13):
        assert word_at(data, at) == int.from_bytes(bytes(data[at : at + 8]), "little")


@given(st.binary(min_size=64, max_size=80), st.integers(0, 255))
def test_a_bit_is_set_for_each_equal_byte(content, letter):
    at = len(content) - 64
    content = content[:-3] + bytes((letter,)) + content[-2:]
    expected = sum(1 << i for i, byte in enumerate(content[at:]) if byte == letter)
    assert places_of(np.frombuffer(content, dtype=np.uint8), at, letter) == expected


def test_the_zeros_below_the_lowest_bit_are_counted():
    assert [zeros_below(word) for word in (1, 2, 3, 96, 2**63, 0)] == [0, 1, 0, 5, 63, 64]
