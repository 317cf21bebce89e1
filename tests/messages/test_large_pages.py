"""Memory in large pages is reused, but only without any reference to it, and forked processes do not share it."""

from __future__ import annotations

import gc
import multiprocessing
import sys

import numpy as np
import pytest

from cdtool.messages.large_pages import Buffers


def test_memory_is_reused_only_if_nothing_refers_to_it():
    buffers = Buffers(1 << 22, kept=3)
    first = buffers.take(100)
    assert len(first) == 1 << 22 and first.ctypes.data % (2 << 20) == 0
    first[:] = 1
    address, part = first.ctypes.data, first[5:10]
    del first
    other = buffers.take(100)
    assert other.ctypes.data != address
    other[:] = 2
    assert part.tolist() == [1] * 5
    view = part.data
    del part
    gc.collect()
    assert buffers.take(100).ctypes.data != address  # a memoryview refers to it, too
    del view
    gc.collect()
    arrays = [buffers.take(100) for _ in range(3)]
    assert address in {each.ctypes.data for each in arrays}


def test_memory_larger_than_a_buffer_is_allocated_in_the_requested_size():
    large = Buffers(1 << 22, kept=3).take(5 << 20)
    assert large.shape == (5 << 20,) and large.dtype == np.uint8


def fill(buffers):
    buffers.take(100)[:] = 7


@pytest.mark.skipif(sys.platform != "linux", reason="workers are forked on Linux only")
def test_a_forked_worker_writes_into_memory_of_its_own():
    buffers = Buffers(1 << 22, kept=3)
    buffers.take(100)[:] = 0
    gc.collect()  # the memory is free when the process is forked, as after the first log of a benchmark
    worker = multiprocessing.get_context("fork").Process(target=fill, args=(buffers,))
    worker.start()
    worker.join()
    assert worker.exitcode == 0
    assert not buffers.take(100).any()


def test_no_more_than_the_stated_number_of_unused_arrays_is_kept():
    buffers = Buffers(1 << 22, kept=1)
    arrays = [buffers.take(100) for _ in range(3)]
    first = arrays[0].ctypes.data
    while arrays:
        arrays.pop(0)[:100] = 9
    gc.collect()
    taken = [buffers.take(100) for _ in range(3)]
    assert sum(int((array[:100] == 9).all()) for array in taken) == 1
    assert taken[0].ctypes.data == first
