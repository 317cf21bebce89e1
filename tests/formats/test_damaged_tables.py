from __future__ import annotations

from tests.formats.damaged_tables import DAMAGES, failures


def test_a_damaged_table_is_read_exactly_or_says_what_is_lost():
    assert list(failures(seed=7, count=8 * len(DAMAGES))) == []
