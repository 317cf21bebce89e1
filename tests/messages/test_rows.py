"""Rows: appended in batches, and confirmed where others wrote them into an array that was shared."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.messages.topic_columns import Rows


def started(expected=10, first=2):
    rows = Rows(expected)
    rows.append(np.arange(float(first)))
    return rows


def test_what_others_wrote_becomes_rows_without_a_copy():
    rows = started()
    table = rows.share(())
    table[2:5] = [7.0, 8.0, 9.0]
    rows.confirm(table, slice(2, 5))
    assert rows.values.tolist() == [0.0, 1.0, 7.0, 8.0, 9.0]
    assert np.shares_memory(rows.values, table)


def test_an_append_never_touches_an_array_that_others_write_into():
    rows = started()
    table = rows.share(())
    table[3:] = -1.0  # in flight: rows of a later chunk
    rows.append(np.array([2.0, 3.0, 4.0]))
    assert rows.values.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert (table[3:] == -1.0).all()
    table[5:7] = [5.0, 6.0]
    rows.confirm(table, slice(5, 7))
    assert rows.values.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]


def test_rows_that_stand_elsewhere_than_they_belong_are_moved():
    rows = started()
    table = rows.share(())
    table[4:6] = [7.0, 8.0]  # the two rows before them were lost
    table[6:8] = [9.0, 10.0]
    rows.confirm(table, slice(4, 6))
    rows.confirm(table, slice(6, 8))
    assert rows.values.tolist() == [0.0, 1.0, 7.0, 8.0, 9.0, 10.0]


def test_rows_of_a_former_array_go_into_the_present_one_which_stays_shared():
    rows = started()
    former = rows.share(())
    rows.append(np.array([2.0]))
    present = rows.share(())
    assert present is not former
    present[5:7] = [5.0, 6.0]  # in flight
    former[3:5] = [3.0, 4.0]
    rows.confirm(former, slice(3, 5))
    rows.confirm(present, slice(5, 7))
    assert rows.values.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0]
    assert np.shares_memory(rows.values, present)


@pytest.mark.parametrize("shape", [(2,), (3, 1)])
def test_an_array_of_other_rows_is_not_shared(shape):
    assert started().share(shape) is None
    assert Rows(5).share(()) is None


def test_an_array_that_had_to_be_copied_again_and_again_is_not_shared_any_more():
    rows = started(expected=1000)
    shared = 0
    while rows.share(()) is not None:
        shared += 1
        rows.append(np.array([1.0]))
        assert shared < 100
    assert rows.values.tolist() == [0.0, 1.0] + shared * [1.0]


def test_more_than_was_foretold_is_appended_all_the_same():
    rows = started(expected=3)
    table = rows.share(())
    table[2] = 2.0
    rows.confirm(table, slice(2, 3))
    rows.append(np.arange(3.0, 50.0))
    assert rows.values.tolist() == list(range(50))
