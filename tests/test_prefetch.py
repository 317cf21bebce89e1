"""The prefetch instruction in a kernel: it is there, and it changes nothing, wherever it points."""

from __future__ import annotations

import numpy as np

from cdtool import prefetch as module
from cdtool.kernels import kernel
from cdtool.prefetch import prefetch


@kernel("int64(Array(uint8, 1, 'C', readonly=True), int64)")
def add_up(data, ahead):
    total = 0
    for i in range(len(data)):
        prefetch(data, i + ahead)
        total += data[i]
    return total


def test_places_beyond_the_memory_do_no_harm():
    data = np.arange(200, dtype=np.uint8)
    for ahead in (0, 64, 10**6, 2**62, -(10**9)):
        assert add_up(data, ahead) == data.sum()


def test_the_instruction_is_in_the_machine_code():
    from numba import njit

    namespace = {"prefetch": module.prefetch.compiled}
    exec("def touch(data, at):\n    prefetch(data, at)\n", namespace)
    touch = njit("void(uint8[::1], int64)")(namespace["touch"])
    (code,) = touch.inspect_llvm().values()
    assert "llvm.prefetch" in code
