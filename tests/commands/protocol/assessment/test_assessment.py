"""From curves to the verdict of a protocol, and the table of edge cases of docs/protocol.md."""

from __future__ import annotations

import datetime as dt
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from cdtool.commands.protocol.assessment.assessment import Repetition, assess_point, check_point, judge
from cdtool.commands.protocol.assessment.plan import (
    Instrument,
    MachineParticulars,
    MeasuringPoint,
    TestParticulars,
    TestPlan,
)
from cdtool.commands.protocol.assessment.reasons import ProtocolVerdict, Reason
from cdtool.truth.force.curve import ForceTimeCurve
from cdtool.truth.force.limits import read_force_limits
from cdtool.truth.force.verdict import averaged

PROFILE = read_force_limits()["en_12453_reducing_gap"]
TIME = np.arange(6000) * 1e-3
POINT = MeasuringPoint(
    name="edge",
    position="closing edge",
    region="gap of 300 mm",
    obstacle_stiffness_n_per_mm=500.0,
    contact_area_mm2=5027.0,
    speed_m_per_s=0.2,
    repetitions=3,
    group="edge",
)
METER = Instrument(
    quantity="force",
    model="Rig",
    serial_number="1",
    calibrated_on=dt.date(2026, 1, 15),
    calibration_valid_until=dt.date(2027, 1, 14),
    range_n=2000.0,
    accuracy_class="1",
    sample_rate_hz=1000.0,
    filter="none",
)
FAILING = {"point_exceeds", "pressure_exceeds", "not_permissible"}
PLAN = TestPlan(
    machine=MachineParticulars("door", "A", "1", "hall", "1.0"),
    test=TestParticulars(tester="B", date=dt.date(2026, 3, 31), place="C", temperature_c=0.0),
    instruments=(METER,),
    points=(POINT,),
)


def curve(force: np.ndarray, time: np.ndarray = TIME, **more: object) -> ForceTimeCurve:
    values = {"at_stop": np.zeros(len(time), dtype=bool), "end": float(time[-1]), **more}
    return ForceTimeCurve(time, force, **values)


def sine(peak: float = 300.0) -> np.ndarray:
    return np.where(TIME <= 0.3, peak * np.sin(np.pi * TIME / 0.3), 0.0)


def repetition(force: ForceTimeCurve, number: int = 1, rest: tuple[float, float] = (0.0, 0.0)) -> Repetition:
    """Return a contact with noise of its own: no two measurements are equal."""
    noise = np.random.default_rng(number).normal(0.0, 0.01, len(force.time))
    return without_noise(replace(force, force=force.force + noise), number, rest)


def without_noise(force: ForceTimeCurve, number: int = 1, rest: tuple[float, float] = (0.0, 0.0)) -> Repetition:
    return Repetition.of((f"{number}.csv", f"sha{number}"), 1, force, PROFILE, rest)


def three(force: ForceTimeCurve, rest: tuple[float, float] = (0.0, 0.0)) -> list[Repetition]:
    """Return three repetitions, the last of which has this force."""
    return [repetition(curve(sine()), 1), repetition(curve(sine()), 2), repetition(force, 3, rest)]


def outcome(repetitions: list[Repetition], **more: object) -> tuple[str, list[str]]:
    found = assess_point(POINT, PROFILE, repetitions, instrument=METER, **more)
    return found.outcome, [reason.kind for reason in found.reasons]


CLIPPED = np.minimum(sine(600.0), 350.0)
STOPPED = CLIPPED == 350.0
EDGE_CASES = {
    "double peak": (curve(np.maximum(sine(), np.roll(sine(200.0), 320))), (0.0, 0.0), "pass", []),
    "double peak, the second after 0.75 s": (
        curve(np.maximum(sine(), np.roll(sine(380.0), 900))),
        (0.0, 0.0),
        "pass",  # the mean of the three meets 150 N
        [],
    ),
    "ringing": (curve(300.0 * np.exp(-TIME / 0.1) * np.cos(60.0 * TIME)), (0.0, 0.0), "pass", []),
    "clipped sensor": (curve(CLIPPED, at_stop=STOPPED), (0.0, 0.0), "incomplete", ["not_assessable"]),
    "beyond the range": (curve(sine()), (1800.0, 0.0), "incomplete", ["beyond_range"]),
    "baseline drift that decides": (curve(sine()), (0.0, 5.0), "incomplete", ["drift_decides"]),
    "baseline drift that does not": (curve(sine()), (0.0, 0.5), "pass", []),
    "contact that never ends": (curve(np.full(6000, 200.0)), (0.0, 0.0), "fail", ["point_exceeds"]),
    "record that ends early": (
        curve(sine()[:2000], TIME[:2000]),
        (0.0, 0.0),
        "incomplete",
        ["record_too_short"],
    ),
    "missing samples": (
        curve(np.delete(sine(), slice(100, 150)), np.delete(TIME, slice(100, 150))),
        (0.0, 0.0),
        "incomplete",
        ["not_assessable"],
    ),
    "one force at the limit": (curve(sine(400.0)), (0.0, 0.0), "pass", []),
    "one above the limit, the mean below": (curve(sine(500.0)), (0.0, 0.0), "pass", []),
    "the mean above the limit": (curve(sine(700.0)), (0.0, 0.0), "fail", ["point_exceeds"]),
    "slow sensor": (curve(sine()[::10], TIME[::10]), (0.0, 0.0), "incomplete", ["rate_too_low", "rate_differs"]),
}


@pytest.mark.parametrize("name", EDGE_CASES)
def test_edge_cases_have_the_intended_answer(name):
    force, rest, wanted, kinds = EDGE_CASES[name]
    found, reasons = outcome(three(force, rest))
    assert found == wanted
    assert set(kinds) <= set(reasons)


@given(st.floats(50.0, 390.0), st.floats(0.1, 0.99))
def test_a_clipped_sensor_is_never_a_pass(peak, share):
    force = np.minimum(sine(peak), share * peak)
    at_stop = force == share * peak
    assert outcome(three(curve(force, at_stop=at_stop)))[0] != "pass"


@given(st.integers(0, 2))
def test_with_too_few_repetitions_nothing_passes(count):
    found, reasons = outcome(three(curve(sine()))[:count])
    assert found == "incomplete" and ("too_few_repetitions" if count else "not_measured") in reasons


def test_more_repetitions_than_planned_all_count_and_are_incomplete_where_they_are_averaged():
    four = [*three(curve(sine())), repetition(curve(sine(100.0)), 4)]
    assert assess_point(replace(POINT, repetitions=4), PROFILE, four, instrument=METER).outcome == "pass"
    alone = replace(PROFILE, average_of=1)
    assert assess_point(POINT, alone, four, instrument=METER).outcome == "pass"
    found = assess_point(POINT, PROFILE, four, instrument=METER)
    assert [reason.kind for reason in found.reasons] == ["too_many_repetitions"]
    assert found.outcome == "incomplete" and found.verdict is not None and found.verdict.tests == 4
    assert found.verdict.steps[0].force == pytest.approx(250.0, abs=0.1)


def test_the_same_recording_under_two_names_is_not_two_measurements():
    items = three(curve(sine()))
    assert outcome([items[0], replace(items[1], sha256="sha1"), items[2]])[1] == ["same_recording"]
    # Two contacts of one recording are two measurements.
    assert outcome([items[0], replace(items[1], sha256="sha1", recording="1.csv", contact=2), items[2]])[0] == "pass"


def test_one_measurement_in_two_files_is_not_two_measurements_nor_one_at_two_points():
    one, two, three_ = three(curve(sine()))
    again = replace(two, curve=replace(one.curve, force=one.curve.force.round(2)))
    found = assess_point(POINT, PROFILE, [one, again, three_], instrument=METER)
    assert [dict(reason.values) for reason in found.reasons] == [
        {"point": "edge", "recording": "2.csv", "other": "1.csv", "contact": 1, "other_contact": 1}
    ]
    assert (found.outcome, found.reasons[0].kind) == ("incomplete", "same_measurement")
    # The same contact, appended to its recording.
    appended = replace(again, sha256=one.sha256, recording=one.recording, contact=2)
    assert outcome([one, appended, three_]) == ("incomplete", ["same_measurement"])
    points = [assess_point(POINT, PROFILE, items, instrument=METER) for items in ([one], [again])]
    kinds = [reason.kind for reason in judge(PLAN, points, "p.toml").reasons]
    assert kinds == ["too_few_repetitions", "too_few_repetitions", "same_measurement"]


CHEST = replace(read_force_limits()["iso_ts_15066_chest"], pressures=())


def of_chest(force: np.ndarray, time: np.ndarray = TIME, number: int = 1) -> tuple[str, list[str]]:
    point = replace(POINT, repetitions=1, obstacle_stiffness_n_per_mm=25.0)
    item = Repetition.of((f"{number}.csv", f"sha{number}"), 1, curve(force, time), CHEST)
    found = assess_point(point, CHEST, [item])
    return found.outcome, [reason.kind for reason in found.reasons]


@pytest.mark.parametrize("seconds", [0.2, 0.49, 0.5, 0.501, 0.6, 0.99])
def test_a_record_that_does_not_hold_half_a_second_of_the_last_step_is_no_pass(seconds):
    count = round(1000 * seconds) + 1
    assert of_chest(sine(200.0)[:count], TIME[:count]) == ("incomplete", ["last_step_too_short"])
    assert of_chest(sine(200.0)[:1001], TIME[:1001]) == ("pass", [])


@given(st.sampled_from([20.0, 50.0, 100.0, 200.0]), st.floats(0.0, 1.0), st.floats(0.02, 0.1))
def test_without_a_stated_sample_rate_no_peak_above_the_limit_hides_between_samples(rate, phase, rise):
    time = np.arange(round(3 * rate)) / rate
    since = time + phase / rate
    force = 284.0 * np.sin(np.pi * since / (2.0 * rise)) * (since < 2.0 * rise)
    assume(force.max() > 0.1 * 284.0)  # below that, no contact is seen
    assert of_chest(force, time)[0] != "pass"


@pytest.mark.parametrize(("equal", "reach", "wanted"), [(2, 310.0, ["near_range"]), (1, 310.0, []), (2, 500.0, [])])
def test_two_equal_readings_close_to_the_range_may_be_a_stop(equal, reach, wanted):
    force = np.minimum(sine(305.0), 290.0 + 10.0 * np.sin(np.pi * TIME / 0.3))
    force[150 : 150 + equal] = 302.0
    items = [*three(curve(sine(200.0)))[:2], without_noise(curve(force), 3)]
    found = assess_point(POINT, PROFILE, items, instrument=replace(METER, range_n=reach))
    assert [reason.kind for reason in found.reasons] == wanted


@pytest.mark.parametrize(
    ("cell", "peak", "wanted"),
    [(10.0, 396.0, ["resolution_decides"]), (10.0, 384.0, []), (1.22, 398.5, []), (0.1, 399.98, [])],
)
def test_a_mean_within_half_a_coarse_cell_of_its_limit_is_no_pass(cell, peak, wanted):
    random = np.random.default_rng(3)
    forces = [cell * np.round((sine(peak) + random.normal(0.0, 0.2 * cell, len(TIME))) / cell) for _ in range(3)]
    forces = [np.minimum(force, cell * np.round(peak / cell)) for force in forces]
    profile = replace(
        PROFILE, steps=(PROFILE.steps[0], *(replace(step, at_most_n=300.0) for step in PROFILE.steps[1:]))
    )
    items = [Repetition.of((f"{n}.csv", f"{n}"), 1, curve(force), profile) for n, force in enumerate(forces)]
    assert [reason.kind for reason in assess_point(POINT, profile, items).reasons] == wanted


def test_an_error_of_a_repetition_above_the_limit_counts_for_the_mean_that_meets_it():
    high = replace(repetition(curve(sine(500.0)), 3), rest_error=20.0)
    items = [repetition(curve(sine(peak)), number) for number, peak in ((1, 340.0), (2, 350.0))]
    assert outcome([*items, high])[1] == ["rest_decides"]
    assert outcome([*items, replace(high, rest_error=8.0)]) == ("pass", [])


@given(st.lists(st.sampled_from([*sorted(FAILING), "no_value", "saturated", "not_measured"]), max_size=6))
def test_no_reason_is_ever_outvoted(kinds):
    verdict = ProtocolVerdict(tuple(Reason(kind) for kind in kinds))
    assert (verdict.outcome == "pass") == (not kinds)
    assert (verdict.outcome == "fail") == bool(FAILING & set(kinds))


def good() -> list:
    return [assess_point(POINT, PROFILE, three(curve(sine())), instrument=METER)]


@pytest.mark.parametrize(
    ("changes", "kind"),
    [
        ({"calibration_valid_until": dt.date(2026, 3, 30)}, "calibration_expired"),
        ({"calibrated_on": dt.date(2026, 4, 1)}, "calibrated_later"),
        ({"sample_rate_hz": 100.0}, "stated_rate_too_low"),
        ({"serial_number": " "}, "no_value"),
        ({"filter": ""}, "no_value"),
        ({"quantity": "speed"}, "no_force_instrument"),
    ],
)
def test_an_instrument_that_does_not_do_makes_it_incomplete(changes, kind):
    verdict = judge(replace(PLAN, instruments=(replace(METER, **changes),)), good(), "p.toml")
    assert verdict.outcome == "incomplete" and kind in [reason.kind for reason in verdict.reasons]


def test_a_calibration_is_valid_on_its_first_and_last_day():
    day = dt.date(2026, 3, 31)
    meter = replace(METER, calibrated_on=day, calibration_valid_until=day)
    assert judge(replace(PLAN, instruments=(meter,)), good(), "p.toml").outcome == "pass"


def test_the_plan_is_checked_before_anything_is_measured():
    wrong = replace(POINT, repetitions=2, obstacle_stiffness_n_per_mm=100.0, peak_pressures_n_per_cm2=(1.0,))
    kinds = [reason.kind for reason in check_point(wrong, PROFILE, recordings=0).reasons]
    assert kinds == ["too_few_planned", "wrong_stiffness", "not_measured", "pressures_missing"]
    assert check_point(POINT, PROFILE, recordings=3).reasons == ()


@pytest.mark.parametrize(("held", "found"), [(1, []), (4, []), (20, ["rate_too_low"])])
def test_a_log_that_repeats_each_reading_has_the_sample_rate_of_the_cell(held, found):
    noise = np.random.default_rng(held).normal(0.0, 0.5, (3, len(TIME)))
    slow = [np.repeat((sine() + some)[::held], held)[: len(TIME)] for some in noise]
    items = [without_noise(curve(force), number) for number, force in enumerate(slow, 1)]
    assert items[0].sample_rate == pytest.approx(1000.0 / held, rel=1e-3)
    meter = replace(METER, sample_rate_hz=1000.0 / held)
    reasons = assess_point(POINT, PROFILE, items, instrument=meter).reasons
    assert [reason.kind for reason in reasons] == found * 3


@pytest.mark.parametrize("region", ["skull_and_forehead", "face"])
@pytest.mark.parametrize("peak", [0.0, 5.0, 64.0, 500.0])
def test_contact_with_the_head_never_passes_whatever_its_force(region, peak):
    profile = read_force_limits()[f"iso_ts_15066_{region}"]
    point = replace(POINT, repetitions=1, obstacle_stiffness_n_per_mm=profile.obstacle_stiffness_n_per_mm)
    item = Repetition.of(("1.csv", "sha1"), 1, curve(sine(peak)), profile)
    for made in (
        assess_point(point, profile, [item]),
        check_point(point, profile, 1),
        assess_point(point, profile, []),
    ):
        assert made.outcome == "fail" and made.reasons[0].kind == "not_permissible"
    assert item.verdict.outcome == "fail" and averaged([item.verdict], profile).outcome == "fail"
    words = "not permissible" if peak < 65.0 else "where"
    assert words in item.verdict.reason
    allowed = replace(profile, permissible=True)
    assert Repetition.of(("1.csv", "sha1"), 1, curve(sine(peak)), allowed).verdict.outcome == (
        "pass" if peak < 65.0 else "fail"
    )


def test_a_reading_at_the_range_of_the_instrument_is_none():
    at_range = sine(300.0)
    at_range[150] = 300.0
    for reach, wanted in ((300.0, ["beyond_range"]), (300.01, []), (5000.0, [])):
        item = without_noise(curve(at_range), 3)
        meter = replace(METER, range_n=reach)
        found = assess_point(POINT, PROFILE, [*three(curve(sine()))[:2], item], instrument=meter)
        of_third = [reason for reason in found.reasons if reason.values["recording"] == "3.csv"]
        assert [reason.kind for reason in of_third] == wanted
