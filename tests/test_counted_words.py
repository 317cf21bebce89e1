"""Counts and their nouns agree, what is masked is not counted again as missing, and what is alike is said once."""

from __future__ import annotations

import pytest

from cdtool.evaluation.alike import grouped
from cdtool.plain_text import counted


@pytest.mark.parametrize(
    ("count", "thing", "verb", "words"),
    [
        (1, "gap", "", "1 gap"),
        (0, "gap", "", "0 gaps"),
        (2, "entry", "", "2 entries"),
        (2, "delay", "", "2 delays"),
        (3, "loss", "", "3 losses"),
        (1, "value", "are", "1 value is"),
        (2, "value", "are", "2 values are"),
        (1, "time stamp", "lie far off", "1 time stamp lies far off"),
        (2, "time stamp", "run backward", "2 time stamps run backward"),
    ],
)
def test_a_count_agrees_with_its_noun_and_its_verb(count, thing, verb, words):
    assert counted(count, thing, verb) == words


def test_singular_and_plural_and_lists_of_any_length_are_alike():
    items = [
        ("a", "1 gap after 0.1 s (4 ms)"),
        ("b", "2 gaps after 0.1 s (4 ms), 0.2 s (5 ms)"),
        ("c", "5 gaps after 0.1 s (4 ms), 0.2 s (5 ms), 0.3 s (6 ms) and 2 more"),
        ("d", "1 gap after 0.4 s (4 ms)"),
        ("e", "1 value is infinite, masked"),
        ("f", "2 values are infinite, masked"),
    ]
    (name, text), *others = grouped(items)
    assert name == "a" and text.endswith("; 3 more like it (b, c, d)")
    assert len(others) == 2  # of two each is shown
