"""Pass, fail and not assessable, for one test and for several at one point."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from cdtool.base.arrays import FloatArray
from cdtool.truth.force.curve import ForceTimeCurve
from cdtool.truth.force.limits import ForceProfile, ForceStep, profile_of, read_force_limits
from cdtool.truth.force.verdict import ForceVerdict, assess_force, averaged

GAP = profile_of(read_force_limits(), "en_12453_reducing_gap")
WIDE = profile_of(read_force_limits(), "en_12453_wide_gap")
RATE, PEAK = float(np.sqrt(500e3 / 620.0)), 0.2 * float(np.sqrt(500e3 * 620.0))
TIME = np.arange(6001) * 1e-3
ORDER = ("fail", "not_assessable", "pass")


def curve(force: FloatArray, time: FloatArray = TIME, clipped: FloatArray | None = None) -> ForceTimeCurve:
    stuck = np.zeros(len(time), dtype=bool) if clipped is None else clipped
    return ForceTimeCurve(time, force, stuck, float(time[-1]))


def leaf(scale: float = 1.0) -> ForceTimeCurve:
    phase = RATE * TIME
    return curve(scale * np.where(phase < np.pi, PEAK * np.sin(phase), 0.0))


def pressing(first: float, then: float = 0.0, last: float = 0.0) -> ForceTimeCurve:
    """A constant force in each step of the gate's profiles."""
    return curve(np.select([TIME < 0.75, TIME < 5.0], [first, then], last))


def outcomes(verdict: ForceVerdict) -> list[str]:
    return [item.outcome for item in verdict.steps]


def test_a_rigid_leaf_of_620_kg_exceeds_400_n_after_4_ms_and_1400_n_after_14_ms():
    for profile, budget in ((GAP, 4.0085e-3), (WIDE, 14.398e-3)):
        verdict = assess_force(leaf(), profile)
        assert outcomes(verdict) == ["fail", "pass", "pass"]
        assert verdict.outcome == "fail"
        assert verdict.time_budget == verdict.steps[0].time_budget == pytest.approx(budget, abs=1e-5)
        assert verdict.steps[0].peak == pytest.approx(3521.0, abs=1.0)
        assert verdict.steps[0].peak_at == pytest.approx(0.5 * np.pi / RATE, abs=1e-3)
        assert verdict.steps[1].time_budget == float("inf")
    assert assess_force(leaf(), GAP).reason.startswith("dynamic: 3521 N where 400 N are allowed, exceeded 4.0 ms")
    assert assess_force(leaf(), GAP).utilisation == pytest.approx(PEAK / 400.0, rel=1e-3)


def test_a_limit_that_starts_under_load_is_exceeded_from_its_start():
    verdict = assess_force(pressing(300.0, 300.0), GAP)
    assert outcomes(verdict) == ["pass", "fail", "pass"]
    assert verdict.time_budget == 0.75
    assert assess_force(pressing(500.0), GAP).time_budget == 0.0


def test_a_record_that_ends_early_is_not_assessable_after_its_end():
    short = TIME <= 1.2
    verdict = assess_force(curve(pressing(100.0).force[short], TIME[short]), GAP)
    assert outcomes(verdict) == ["pass", "not_assessable", "not_assessable"]
    assert verdict.outcome == "not_assessable"
    assert verdict.reason == "static: the record ends 1.2 s after the onset, the limit holds until 5 s"
    assert "before 5 s" in verdict.steps[2].reason
    assert np.isnan(verdict.steps[2].peak)


def test_missing_samples_make_a_step_not_assessable_and_only_that_one():
    kept = (TIME < 2.0) | (TIME > 2.1)
    verdict = assess_force(curve(pressing(100.0).force[kept], TIME[kept]), GAP)
    assert outcomes(verdict) == ["pass", "not_assessable", "pass"]
    assert verdict.steps[1].reason == "load-cell samples are missing for 102 ms"


def test_after_missing_samples_the_time_budget_counts_from_their_beginning():
    kept = (TIME <= 0.002) | (TIME > 0.020)
    assert assess_force(curve(leaf().force[kept], TIME[kept]), GAP).time_budget == pytest.approx(0.002)


def test_a_cell_at_its_stop_below_the_limit_is_not_assessable_and_above_it_fails():
    true = leaf(0.3)  # 1056 N
    for stop, expected in ((800.0, "not_assessable"), (3000.0, "pass")):
        force = np.minimum(true.force, stop)
        verdict = assess_force(curve(force, clipped=force >= stop), WIDE)
        assert outcomes(verdict) == [expected, "pass", "pass"]
    force = np.minimum(true.force, 800.0)
    assert assess_force(curve(force, clipped=force >= 800.0), GAP).steps[0].outcome == "fail"
    assert "at its stop, 800 N, below" in assess_force(curve(force, clipped=force >= 800.0), WIDE).reason


def test_a_step_between_two_samples_is_not_assessable():
    narrow = ForceProfile(
        "n", "n", "n", True, (ForceStep(0.0, 9.0, "a"), ForceStep(1.2e-3, 9.0, "b"), ForceStep(1.8e-3, 9.0, "c"))
    )
    verdict = assess_force(pressing(1.0), narrow)
    assert outcomes(verdict) == ["pass", "not_assessable", "pass"]
    assert "no load-cell sample" in verdict.reason


forces = arrays(np.float64, 61, elements=st.floats(-50.0, 600.0))
masks = arrays(np.bool_, 61)
limits = st.lists(st.floats(1.0, 700.0), min_size=3, max_size=3)


def random_curve(force: FloatArray, kept: FloatArray, stuck: FloatArray) -> ForceTimeCurve:
    time = np.arange(61) * 0.1
    kept = kept.copy()
    kept[0] = True
    return ForceTimeCurve(time[kept], force[kept], stuck[kept], 6.0)


def with_limits(values: Sequence[float]) -> ForceProfile:
    steps = tuple(replace(step, at_most_n=value) for step, value in zip(GAP.steps, values, strict=True))
    return replace(GAP, steps=steps)


@given(forces, masks, masks, limits, st.lists(st.floats(1.0, 3.0), min_size=3, max_size=3))
@settings(deadline=None)
def test_a_higher_limit_never_makes_a_verdict_worse(force, kept, stuck, low, factors):
    tested = random_curve(force, kept, stuck)
    strict = assess_force(tested, with_limits(low))
    mild = assess_force(tested, with_limits([value * factor for value, factor in zip(low, factors, strict=True)]))
    for before, after in zip(strict.steps, mild.steps, strict=True):
        assert ORDER.index(after.outcome) >= ORDER.index(before.outcome)
        assert after.time_budget >= before.time_budget
    assert ORDER.index(mild.outcome) >= ORDER.index(strict.outcome)


@given(forces, masks, masks, limits)
@settings(deadline=None)
def test_a_step_fails_exactly_where_a_sample_exceeds_it_and_its_budget_lies_within_it(force, kept, stuck, low):
    tested = random_curve(force, kept, stuck)
    profile = with_limits(low)
    for i, verdict in enumerate(assess_force(tested, profile).steps):
        inside = (tested.time >= verdict.step.from_s) & (tested.time < profile.ends(i))
        assert (verdict.outcome == "fail") == bool(np.any(tested.force[inside] > verdict.step.at_most_n))
        assert np.isfinite(verdict.time_budget) == (verdict.outcome == "fail")
        if verdict.outcome == "fail":
            assert verdict.step.from_s <= verdict.time_budget < profile.ends(i)


def test_three_tests_are_averaged_step_by_step():
    tests = [
        assess_force(pressing(first, then), GAP) for first, then in ((450.0, 90.0), (380.0, 130.0), (340.0, 110.0))
    ]
    point = averaged(tests, GAP)
    assert [item.force for item in point.steps] == pytest.approx([390.0, 110.0, 0.0])
    assert point.outcome == "pass"
    assert [item.above for item in point.steps] == [1, 0, 0]
    assert (point.tests, point.note) == (3, "mean of 3 tests")
    harder = averaged([*tests[:2], assess_force(pressing(380.0), GAP)], GAP)
    assert [item.outcome for item in harder.steps] == ["fail", "pass", "pass"]
    assert harder.reason == "dynamic: mean of 3 peaks 403.3 N where 400 N are allowed"


def test_fewer_tests_than_are_averaged_are_not_assessable_and_more_are_all_averaged():
    one = assess_force(pressing(900.0), GAP)
    few = averaged([one, one], GAP)
    assert few.outcome == "not_assessable"
    assert few.reason == "dynamic: 2 of the 3 tests that are averaged"
    assert few.note == "mean of 2 tests where the profile averages 3"
    many = averaged([assess_force(pressing(force), GAP) for force in (100.0, 200.0, 300.0, 1200.0)], GAP)
    assert many.steps[0].force == pytest.approx(450.0)
    assert many.note == "mean of 4 tests where the profile averages 3"
    assert many.outcome == "fail"
    assert averaged([], GAP).outcome == "not_assessable"


def test_an_unassessable_test_makes_a_step_unassessable_unless_its_mean_fails():
    short = TIME <= 1.2
    cut = assess_force(curve(pressing(100.0, 600.0).force[short], TIME[short]), with_limits([400.0, 700.0, 25.0]))
    whole = assess_force(pressing(100.0, 100.0), with_limits([400.0, 700.0, 25.0]))
    point = averaged([whole, whole, cut], with_limits([400.0, 700.0, 25.0]))
    assert [item.outcome for item in point.steps] == ["pass", "not_assessable", "not_assessable"]
    assert "the record ends" in point.reason
    assert np.isnan(point.steps[2].force)
    lower = with_limits([400.0, 650.0, 25.0])
    loud = assess_force(pressing(100.0, 900.0), lower)
    cut = assess_force(curve(pressing(100.0, 600.0).force[short], TIME[short]), lower)
    assert cut.steps[1].outcome == "not_assessable"
    assert averaged([loud, loud, cut], lower).steps[1].outcome == "fail"


def test_without_averaging_the_highest_test_counts():
    face = profile_of(read_force_limits(), "iso_ts_15066_face")
    tests = [assess_force(pressing(force), face) for force in (10.0, 10.0, 70.0)]
    point = averaged(tests, face)
    assert [item.outcome for item in point.steps] == ["fail", "fail"]
    assert (point.steps[0].force, point.note) == (70.0, "highest of 3 tests")
    assert averaged(tests[:1], face).note == "highest of 1 test"
    short = TIME <= 0.3
    cut = assess_force(curve(pressing(10.0).force[short], TIME[short]), face)
    late = assess_force(curve(np.where(TIME < 0.5, 0.0, 80.0)), face)
    assert averaged([cut, late], face).steps[1].outcome == "fail"
