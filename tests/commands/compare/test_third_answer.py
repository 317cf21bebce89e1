"""Two builds: "no change shown" only with the power for it, else "inconclusive"; complete changes with exact p."""

from __future__ import annotations

import math
from itertools import combinations

import numpy as np
import pytest

from cdtool.base.errors import UsageError
from cdtool.base.exit_status import Fact, status_of
from cdtool.commands.compare.comparison import compare
from cdtool.statistics.rates import binomial_at_most, binomial_increase_at_most, poisson_increase_at_most
from tests.commands.compare.questions import asked, latencies, row_of, single
from tests.synthetic.builds import MISSED, NOT_ASSESSABLE, build_results

OTHERS = {"bytes_of": "other", "names": "x"}


def test_the_example_of_a_debounce_of_200_is_worse_and_inconclusive_never_no_change():
    stiff, soft = ("friction_ekf", "stiff"), ("friction_ekf", "soft")
    old = build_results({stiff: [33.0, 31.0, 35.0, 34.0], soft: [82.0, 79.0, 88.0, 81.0]}, hours=0.01)
    new = build_results({stiff: [MISSED] * 4, soft: [330.0, 310.0, 350.0, 320.0]}, hours=0.01)
    found = compare(old, new)
    assert found.verdict == "worse" and "no change" not in found.words
    by_group = {row.group: row for row in found.rows}
    assert by_group["stiff"].outcome == "worse" and by_group["soft"].outcome == "inconclusive"
    assert "misses every contact: 4 of 4, before 0 of 4 (probability by chance 0.0625)" in by_group["stiff"].words
    same = "on the same 4 contacts: 4 later by 231 to 262 ms"
    assert by_group["soft"].words.startswith(f"{same}; inconclusive: latency (too few recordings for")
    assert set(found.facts) == {Fact.WORSE, Fact.INCONCLUSIVE} and status_of(found.facts) == 1


@pytest.mark.parametrize("n", [1, 2, 4, 7, 30])
def test_every_contact_missed_that_was_detected_has_a_probability_of_one_half_for_each(n):
    question = asked(compare(single(latencies(n)), single([MISSED] * n)), "missed")
    assert question.complete_change_p == pytest.approx(0.5**n, rel=1e-12) and question.outcome == "worse"
    back = asked(compare(single([MISSED] * n), single(latencies(n))), "missed")
    assert back.complete_change_p == pytest.approx(0.5**n, rel=1e-12) and back.outcome == "better"


@pytest.mark.parametrize(("n_old", "n_new"), [(3, 3), (4, 4), (4, 6), (9, 2)])
def test_on_other_contacts_the_probability_is_that_of_one_division_in_all(n_old, n_new):
    question = asked(compare(single(latencies(n_old)), single([MISSED] * n_new, **OTHERS)), "missed")
    divisions = len(list(combinations(range(n_old + n_new), n_old)))
    assert question.complete_change_p == pytest.approx(1.0 / divisions, rel=1e-12) and question.outcome == "worse"


@pytest.mark.parametrize(
    ("old", "new", "others"),
    [
        (latencies(2), [MISSED] * 2, OTHERS),
        ([40.0, *[MISSED] * 9], [MISSED] * 10, {}),
        (latencies(4), [40.0, *[MISSED] * 3], {}),
    ],
    ids=["two against two others", "hardly anything was detected", "one is still detected"],
)
def test_a_change_that_is_not_complete_is_inconclusive(old, new, others):
    question = asked(compare(single(old), single(new, **others)), "missed")
    assert math.isnan(question.complete_change_p) and question.outcome == "inconclusive"


def test_a_build_that_can_no_longer_assess_anything_is_worse_for_any_number_of_contacts():
    found = compare(single(latencies(3)), single([NOT_ASSESSABLE] * 3))
    assert found.verdict == "worse" and asked(found, "not_assessable").complete_change_p == 0.125
    assert "nothing is assessable: not assessable 3 of 3, before 0 of 3" in row_of(found).words


def test_four_contacts_are_inconclusive_and_thirty_are_not():
    for n, verdict in ((4, "inconclusive"), (30, "no change shown")):
        old = latencies(n, 40.0, 3.0)
        noise = latencies(n, 0.0, 2.0, seed=5)
        noise = [x - float(np.mean(noise)) for x in noise]
        found = compare(single(old), single([a + b for a, b in zip(old, noise, strict=True)]))
        assert found.verdict == verdict, n
        assert found.words.startswith(verdict) and (Fact.INCONCLUSIVE in found.facts) == (n == 4)


def test_a_spread_too_large_for_a_relevant_change_is_inconclusive_with_the_detectable_change():
    old = latencies(30, 40.0, 3.0)
    noise = latencies(30, 0.0, 20.0, seed=6)
    noise = [x - float(np.mean(noise)) for x in noise]
    new = single([a + b for a, b in zip(old, noise, strict=True)], force=None)
    found = compare(single(old, force=None), new)
    latency = asked(found, "latency_ms")
    assert found.verdict == "inconclusive" and latency.left_open == pytest.approx(latency.detectable / latency.old)
    assert f"only a change of {latency.detectable:.1f} ms would have been shown" in row_of(found).words
    wide = compare(single(old, force=None), new, relevant_change=0.5)
    assert wide.verdict == "no change shown" and wide.relevant_change == 0.5


@pytest.mark.parametrize("n", [3, 29, 30, 100])
def test_an_increase_after_nothing_is_bounded_by_the_new_count_alone(n):
    assert binomial_increase_at_most(0, n, 0, 17) == pytest.approx(1.0 - 0.05 ** (1.0 / n), rel=1e-9)
    assert binomial_increase_at_most(0, n, 0, 17) == pytest.approx(binomial_at_most(0, n))
    assert poisson_increase_at_most(0, n, 0, 17) == pytest.approx(-math.log(0.05) / n, rel=1e-9)


def test_bounds_of_an_increase_hold_in_at_least_95_of_100_draws():
    rng = np.random.default_rng(7)
    for p, n in ((0.05, 30), (0.3, 40)):
        a, b = rng.binomial(n, p + 0.1, 1000), rng.binomial(n, p, 1000)
        held = [binomial_increase_at_most(int(x), n, int(y), n) >= 0.1 for x, y in zip(a, b, strict=True)]
        assert np.mean(held) >= 0.94
    for rate, exposure in ((0.05, 40.0), (0.5, 60.0)):
        a, b = rng.poisson((rate + 0.1) * exposure, 1000), rng.poisson(rate * exposure, 1000)
        held = [poisson_increase_at_most(int(x), exposure, int(y), exposure) >= 0.1 for x, y in zip(a, b, strict=True)]
        assert np.mean(held) >= 0.94


def test_the_smallest_relevant_change_is_a_share():
    for wrong in (0.0, -0.1, 1.5, math.nan):
        with pytest.raises(UsageError, match="relevant change is"):
            compare(single(latencies()), single(latencies()), relevant_change=wrong)
