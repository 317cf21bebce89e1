"""Rows: appended in batches, and confirmed after other threads have written them into the shared array."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.messages.topic_columns import Rows


def rows_with(expected=10, first=2):
    rows = Rows(expected)
    rows.append(np.arange(float(first)))
    return rows


def test_confirmed_values_become_rows_without_a_copy():
    rows = rows_with()
    table = rows.share(())
    table[2:5] = [7.0, 8.0, 9.0]
    rows.confirm(table, slice(2, 5))
    assert rows.values.tolist() == [0.0, 1.0, 7.0, 8.0, 9.0]
    assert np.shares_memory(rows.values, table)


def test_an_append_does_not_change_a_shared_array():
    rows = rows_with()
    table = rows.share(())
    table[3:] = -1.0  # not yet confirmed: rows of a later chunk
    rows.append(np.array([2.0, 3.0, 4.0]))
    assert rows.values.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert (table[3:] == -1.0).all()
    table[5:7] = [5.0, 6.0]
    rows.confirm(table, slice(5, 7))
    assert rows.values.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]


def test_confirmed_rows_are_moved_to_follow_the_last_row():
    rows = rows_with()
    table = rows.share(())
    table[4:6] = [7.0, 8.0]  # the two rows before them were lost
    table[6:8] = [9.0, 10.0]
    rows.confirm(table, slice(4, 6))
    rows.confirm(table, slice(6, 8))
    assert rows.values.tolist() == [0.0, 1.0, 7.0, 8.0, 9.0, 10.0]


def test_rows_of_a_replaced_array_are_copied_into_the_present_one_which_remains_shared():
    rows = rows_with()
    former = rows.share(())
    rows.append(np.array([2.0]))
    present = rows.share(())
    assert present is not former
    present[5:7] = [5.0, 6.0]  # not yet confirmed
    former[3:5] = [3.0, 4.0]
    rows.confirm(former, slice(3, 5))
    rows.confirm(present, slice(5, 7))
    assert rows.values.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    assert np.shares_memory(rows.values, present)


@pytest.mark.parametrize("shape", [(2,), (3, 1)])
def test_an_array_with_rows_of_another_shape_is_not_shared(shape):
    assert rows_with().share(shape) is None
    assert Rows(5).share(()) is None


def test_an_array_that_was_copied_too_often_is_no_longer_shared():
    rows = rows_with(expected=1000)
    shared = 0
    while rows.share(()) is not None:
        shared += 1
        rows.append(np.array([1.0]))
        assert shared < 100
    assert rows.values.tolist() == [0.0, 1.0] + shared * [1.0]


def test_more_rows_than_expected_are_appended():
    rows = rows_with(expected=3)
    table = rows.share(())
    table[2] = 2.0
    rows.confirm(table, slice(2, 3))
    rows.append(np.arange(3.0, 50.0))
    assert rows.values.tolist() == list(range(50))
