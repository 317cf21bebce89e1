"""Rows held as columns are the rows that were given, in every way of reading them."""

from __future__ import annotations

import pickle
from collections import Counter
from dataclasses import fields, replace

import pytest

from cdtool.results.results import ContactResult, ForceResult, RecordingFinding, RecordingResult, Skipped
from cdtool.results.rows import Rows, grouped, picked, values_of
from tests.results.full_results import FULL
from tests.synthetic.many_results import many_results

MANY = many_results(1600)
KINDS = {
    "contacts": ContactResult,
    "recordings": RecordingResult,
    "forces": ForceResult,
    "findings": RecordingFinding,
    "skipped": Skipped,
}


@pytest.fixture(params=KINDS)
def given(request) -> tuple[type, tuple]:
    """The class of rows, and more of them than are made at once."""
    return KINDS[request.param], tuple(getattr(MANY, request.param)) * (1 + 1100 // len(getattr(MANY, request.param)))


def test_they_equal_the_rows_that_were_given_however_they_are_read(given):
    kind, rows = given
    held = Rows(kind, rows)
    assert len(held) == len(rows) > 1024
    assert held == rows and tuple(held) == rows and rows == tuple(held[:])
    assert [held[i] for i in range(len(rows))] == list(rows)
    assert held[-1] == rows[-1] and held[5:1500:7] == rows[5:1500:7] and held[1030:3:-5][2:4] == rows[1030:3:-5][2:4]
    assert list(reversed(held)) == list(reversed(rows))
    assert {type(row) for row in held} == {kind}


def test_a_field_is_read_without_the_rows(given):
    kind, rows = given
    held = Rows(kind, rows)
    for item in fields(kind):
        wanted = [getattr(row, item.name) for row in rows]
        assert list(values_of(held, item.name)) == list(values_of(rows, item.name)) == wanted
        assert list(values_of(held[3:40:3], item.name)) == wanted[3:40:3]


def test_no_value_and_not_a_number_are_two_things():
    row = replace(FULL.contacts[0], latency_ms=None, peak_force_n=float("nan"), limit=float("inf"), contact=10**30)
    (made,) = Rows(ContactResult, [row])
    assert made.latency_ms is None and made.peak_force_n != made.peak_force_n
    assert made.limit == float("inf") and made.contact == 10**30


def test_they_differ_from_other_rows_and_grow():
    held = Rows(Skipped, [Skipped("a", "empty")])
    assert held != [] and held != (Skipped("b", "empty"),) and held != "a"
    held += (Skipped("b", "empty"),)
    held.append(Skipped("c", "cut"))
    assert held[1:] == (Skipped("b", "empty"), Skipped("c", "cut"))
    with pytest.raises(IndexError):
        held[3]


def test_they_are_grouped_as_tuples_are():
    held = grouped(MANY.contacts, "group", "detector")
    plain = grouped(tuple(MANY.contacts), "group", "detector")
    assert list(held) == list(plain) and all(held[key] == plain[key] for key in plain)
    counts = Counter((row.group, row.detector) for row in MANY.contacts)
    assert {key: len(rows) for key, rows in held.items()} == counts
    some = held["stiff", "momentum"]
    assert picked(some, [4, 0]) == (some[4], some[0])
    assert list(grouped(some, "outcome")) == list(dict.fromkeys((row.outcome,) for row in some))


def test_another_process_receives_the_same_rows():
    assert pickle.loads(pickle.dumps(MANY.forces)) == MANY.forces


def test_no_row_of_a_detector_and_group_is_there_before_it_is_asked_for():
    taken = MANY.contacts.picked(range(10))
    assert not any(isinstance(value, ContactResult) for value in vars(taken).values())
    assert taken[0] is not taken[0]


def test_blocks_of_columns_make_the_same_rows(given):
    kind, rows = given
    again = Rows(kind)
    for columns in Rows(kind, rows).blocks(100):
        again.extend_columns(columns)
    assert again == rows and len(again) == len(rows)
    with pytest.raises(ValueError, match="columns of"):
        again.extend_columns([["a"]] if len(fields(kind)) != 1 else [])
    assert again == rows


def test_a_column_without_some_values_is_the_same_one_by_one_and_at_once():
    values = [1.5, None, float("nan"), 2.0]
    rows = [replace(FULL.contacts[0], latency_ms=value) for value in values]
    again = Rows(ContactResult)
    again.extend_columns([[getattr(row, item.name) for row in rows] for item in fields(ContactResult)])
    assert repr([row.latency_ms for row in again]) == repr(values)
