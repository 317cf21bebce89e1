"""Text from files is made safe, long text short, and counts agree with their nouns."""

from __future__ import annotations

import pytest

from cdtool.base.plain_text import counted, plain
from tests.report.hostile import HOSTILE


@pytest.mark.parametrize("kind", HOSTILE)
def test_plain_text_is_one_line_of_printable_characters_of_the_same_length(kind):
    text = plain(HOSTILE[kind])
    assert len(text) == len(HOSTILE[kind])
    assert len(text.splitlines()) <= 1
    assert text.isprintable()
    text.encode("utf-8")


def test_ordinary_text_of_any_language_stays():
    assert plain("Tür 7 — 門 α_β.csv") == "Tür 7 — 門 α_β.csv"


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
