"""Missing load-cell samples on a dozen random contacts; benchmarks/missing_force.py of commit def748d0 has 200."""

from __future__ import annotations

from tests.truth.holes_in_force import score


def test_no_hole_causes_an_unmarked_wrong_onset_or_an_unmeasured_pass():
    counts, wrong = score(31, 12, 12)
    assert wrong == []
    assert sum(count.marked for count in counts.values()) > 10
    assert counts["single samples"].passes > 5 and counts["single samples"].marked == 0
