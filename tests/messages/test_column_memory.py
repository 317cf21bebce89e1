from __future__ import annotations

import mmap

import numpy as np
import pytest

from cdtool.messages.column_memory import ColumnMemory


def test_arrays_do_not_overlap_and_have_the_requested_shape_and_type():
    memory = ColumnMemory()
    shapes = [(40_000,), (40_001, 3), (7,), (5_000_000,), (33_000, 2)]
    arrays = [memory.empty(shape, dtype) for shape in shapes for dtype in (np.float64, np.uint64)]
    for number, array in enumerate(arrays):
        array[...] = number
    for number, array in enumerate(arrays):
        assert (array == number).all()
    assert [array.shape for array in arrays[::2]] == shapes
    assert all(array.dtype == np.float64 for array in arrays[::2])
    assert all(array.flags.c_contiguous and array.flags.writeable and array.flags.aligned for array in arrays)


def test_arrays_outlive_their_memory():
    array = ColumnMemory().empty((100_000,))
    array[:] = 1.5
    other = ColumnMemory().empty((100_000,))
    other[:] = 2.5
    assert (array == 1.5).all()


def test_a_system_without_large_pages_uses_usual_memory(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.delattr(mmap, "MADV_HUGEPAGE", raising=False)
    array = ColumnMemory().empty((100_000, 2))
    assert array.shape == (100_000, 2) and array.base is None
