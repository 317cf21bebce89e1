"""Instructions in kernels: prefetch changes nothing at any address; store writes a value only at its address.

load reads eight bytes at any address; equal_bytes, trailing_zeros and add_products agree with the same operation in
Python. A part is the memory of its array; wider vectors change no number.
"""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cdtool.instructions import (
    LANES,
    add_products,
    add_rows,
    aligned_zeros,
    equal_bytes,
    load,
    part_of,
    prefetch,
    set_rows,
    store,
    trailing_zeros,
    widest_vectors,
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


@kernel("void(float64[::1], int64, float64[::1], int64, float64[::1], int64, int64)")
def add_to(sums, at, first, first_at, second, second_at, count):
    add_products(sums, at, first, first_at, second, second_at, count)


@given(st.integers(0, 5), st.integers(0, 40), st.integers(0, 40), st.integers(0, 40))
def test_products_are_added_to_their_own_numbers_only(count, at, first_at, second_at):
    rng = np.random.default_rng(count)
    sums, first, second = rng.normal(size=(3, 6 * LANES + 40))
    expected = sums.copy()
    for number in range(count):
        a, b = (item[start + number * LANES :][:LANES] for item, start in ((first, first_at), (second, second_at)))
        expected[at : at + LANES] += a * b
    before = sums.copy()
    add_to(sums, at, first, first_at, second, second_at, count)
    np.testing.assert_allclose(sums, expected, rtol=0.0, atol=1e-14)
    beside = np.ones(len(sums), dtype=bool)
    beside[at : at + LANES] = False
    np.testing.assert_array_equal(sums[beside], before[beside])


@kernel("void(float64[::1], int64, float64[::1], int64, float64[::1], int64, int64)")
def add_rows_to(sums, at, rows, first, factors, factors_at, count):
    add_rows(sums, at, rows, first, factors, factors_at, count)


@kernel("void(float64[::1], int64, float64[::1], int64, float64[::1], int64, int64)")
def set_rows_of(results, at, rows, first, factors, factors_at, count):
    set_rows(results, at, rows, first, factors, factors_at, count)


@given(st.integers(0, 5), st.integers(0, 40), st.integers(0, 40), st.integers(0, 40))
def test_rows_are_added_or_set_and_what_is_beside_them_is_not_touched(count, at, first, factors_at):
    rng = np.random.default_rng(count)
    sums, rows, factors = rng.normal(size=(3, 6 * LANES + 40))
    results, before, size = sums.copy(), sums.copy(), count * LANES
    products = rows[first : first + size] * np.tile(factors[factors_at : factors_at + LANES], count)
    add_rows_to(sums, at, rows, first, factors, factors_at, count)
    set_rows_of(results, at, rows, first, factors, factors_at, count)
    np.testing.assert_allclose(sums[at : at + size], before[at : at + size] + products, rtol=0.0, atol=1e-14)
    np.testing.assert_array_equal(results[at : at + size], products)
    for found in (sums, results):
        np.testing.assert_array_equal(np.delete(found, slice(at, at + size)), np.delete(before, slice(at, at + size)))


def test_rows_can_be_set_in_their_own_place():
    rows, half = np.arange(3.0 * LANES), np.full(LANES, 0.5)
    set_rows_of(rows, 0, rows, 0, half, 0, 3)
    assert rows.tolist() == [0.5 * number for number in range(3 * LANES)]


def test_zeros_can_be_aligned_to_cache_lines():
    for count in (1, 100, 4608):
        zeros = aligned_zeros(count)
        assert zeros.shape == (count,) and not zeros.any() and zeros.ctypes.data % 64 == 0


@kernel("int64(float64[:, ::1], int64, int64)")
def double_part(table, at, size):
    part = part_of(table, at, size)
    for i in range(len(part)):
        part[i] *= 2.0
    return len(part)


@given(st.integers(0, 12), st.integers(0, 12))
def test_a_part_is_the_memory_of_its_array_in_its_order(first, second):
    at, end = sorted((first, second))
    table = np.arange(1.0, 13.0).reshape(3, 4)
    expected = table.ravel().copy()
    expected[at:end] *= 2.0
    assert double_part(table, at, end - at) == end - at
    assert table.ravel().tolist() == expected.tolist()


def cubed(values, results):
    for i in range(len(values)):
        results[i] = values[i] * values[i] * values[i] + 0.1


def test_with_the_widest_vectors_the_numbers_are_the_same():
    from numba import njit

    namespace = {"widest_vectors": widest_vectors.part}
    exec(
        "def cubed(values, results):\n    widest_vectors()\n    for i in range(len(values)):\n"
        "        results[i] = values[i] * values[i] * values[i] + 0.1\n",
        namespace,
    )
    signature = "void(float64[::1], float64[::1])"
    wide, usual = njit(signature)(namespace["cubed"]), njit(signature)(cubed)
    values, results = np.linspace(-3.0, 3.0, 101), np.zeros((2, 101))
    wide(values, results[0])
    usual(values, results[1])
    assert results[0].tobytes() == results[1].tobytes()
    assert '"prefer-vector-width"="512"' in next(iter(wide.inspect_llvm().values()))
    assert '"prefer-vector-width"="512"' not in next(iter(usual.inspect_llvm().values()))
