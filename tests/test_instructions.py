"""Instructions in kernels: prefetch changes nothing at any address; store writes a value only at its address."""

from __future__ import annotations

import numpy as np

from cdtool.instructions import prefetch, store
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

    namespace = {"prefetch": prefetch.compiled}
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
