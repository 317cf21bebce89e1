"""`cdtool init`: stated units, marked guesses, and the ratio of position to speed."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import cdtool
from cdtool.recordings.units import find_unit
from tests.commands.init.drafts import RPM, drafted, drafted_columns, stroke

LEAD = 1.5e-3  # travel per motor angle [m/rad]


@pytest.mark.parametrize(("effort", "units"), [("force_motor", ("m", "m/s")), ("torque", ("rad", "rad/s"))])
@pytest.mark.parametrize("rate", [2500, 4000, 10000])
def test_an_unstated_clock_unit_is_guessed_with_those_of_position_and_speed(tmp_path, rate, effort, units):
    run = stroke(1.0 / rate)
    draft = drafted_columns(tmp_path, {"time": run.time * 1e3, "pos": run.travel, "vel": run.speed, effort: run.torque})
    assert draft.channels["time"] == {"column": "time", "unit": "ms"}
    assert (draft.unit("position"), draft.unit("speed")) == units
    assert all(draft.checked(key) for key in ("time", "position", "speed"))
    assert "ms with mm, mm/s" in draft.said("time") and "s with m, mm/s fit as well" in draft.said("time")


def test_a_counter_gets_a_rate_and_a_mark_not_a_unit_of_time(tmp_path):
    run = stroke()
    ticks = np.arange(len(run.time)) * 10.0
    draft = drafted_columns(tmp_path, {"ticks": ticks, "pos": run.travel, "vel": run.speed})
    assert draft.channels["time"]["rate_hz"] == pytest.approx(1e4, rel=0.01)
    assert draft.checked("time") and draft.unit("position") == "m"
    alone = drafted_columns(tmp_path, {"ticks": ticks, "n": run.speed})
    assert "placeholder" in alone.said("time") and alone.checked("time")


@pytest.mark.parametrize(
    ("column", "factor", "checked"),
    [
        *((name, 1.0, True) for name in ("t", "Zeit", "timestamp")),  # no unit is stated, though the guess is right
        *((name, 1.0, False) for name in ("time_s", "t [s]")),
        *((name, 1e3, True) for name in ("time [s]", "时间(s)")),  # it counts milliseconds
    ],
)
def test_a_clock_is_marked_where_its_unit_is_not_stated_or_does_not_fit_the_motion(tmp_path, column, factor, checked):
    run = stroke()
    draft = drafted_columns(
        tmp_path, {column: factor * run.time, "pos [mm]": 1e3 * run.travel, "vel [mm/s]": 1e3 * run.speed}
    )
    assert draft.channels["time"]["unit"] == "s" and draft.checked("time") is checked
    assert ("ms with mm, mm/s fits the ratio, s does not" in draft.said("time")) is (factor > 1.0)


def test_names_on_both_sides_of_a_gear_give_the_ratio_with_a_mark(tmp_path):
    run = stroke()
    draft = drafted_columns(
        tmp_path,
        {
            "LogTime_ms": run.time * 1e3, "Tor1.Antrieb.Ist_Drehzahl": run.speed / LEAD * RPM,
            "Tor1.Antrieb.Ist_Moment": run.torque, "Tor1.Ist_Position": run.travel * 1e3, "AI_Kraft": run.force,
        },
    )  # fmt: skip
    assert draft.machine["transmission_ratio"] == pytest.approx(LEAD, rel=2e-3)
    assert (draft.unit("position"), draft.unit("speed"), draft.channels["time"]["unit"]) == ("mm", "rpm", "ms")
    assert all(draft.checked(key) for key in ("position", "speed", "torque", "force", "transmission_ratio"))


@settings(max_examples=12, deadline=None)
@given(
    lead=st.floats(2.5e-4, 0.1),
    position=st.sampled_from(["mm", "m", "cm"]),
    speed=st.sampled_from(["rpm", "rad/s", "deg/s"]),
    clock=st.sampled_from(["s", "ms"]),
)
def test_the_ratio_of_a_gear_is_that_of_the_motion_in_any_units(tmp_path_factory, lead, position, speed, clock):
    def of(values, unit):
        return values / find_unit(unit).factor

    run, folder = stroke(), tmp_path_factory.mktemp("gear")
    columns = {
        f"t [{clock}]": of(run.time, clock), f"x [{position}]": of(run.travel, position),
        f"n [{speed}]": of(run.speed / lead, speed),
    }  # fmt: skip
    draft = drafted_columns(folder, columns)
    assert draft.machine["transmission_ratio"] == pytest.approx(lead, rel=3e-3)
    assert draft.channels["time"]["unit"] == clock and not draft.checked("position") and not draft.checked("speed")


def test_header_units_that_the_ratio_contradicts_are_marked(tmp_path):
    run = stroke()
    columns = {"t [s]": run.time, "pos [mm]": run.travel * 1e3, "vel [m/s]": run.speed * 0.8}
    draft = drafted_columns(tmp_path, columns)
    assert draft.unit("speed") == "m/s" and "1.25 of the speed, not 1" in draft.said("speed")


@pytest.mark.parametrize(
    ("clock", "position", "speed", "certain"),
    [("t [s]", "phi", "n", True), ("t [s]", "pos", "n", False), ("ticks", "phi", "n", False)],
    ids=["an angle by name", "a position that may be a travel", "a counter whose rate fits any ratio"],
)
def test_a_ratio_is_certain_only_if_names_and_clock_agree(tmp_path, clock, position, speed, certain):
    run = stroke()
    time = run.time * (1e4 if clock == "ticks" else 1.0)
    draft = drafted_columns(tmp_path, {clock: time, position: run.travel, speed: run.speed * RPM})
    assert (draft.unit("position"), draft.unit("speed")) == ("rad", "rpm")
    assert draft.checked("position") is not certain and draft.checked("speed") is not certain


@pytest.mark.parametrize(("step", "doubted"), [(20.0, True), (1.0, True), (0.02, False)])
def test_a_stated_unit_that_makes_a_log_slower_than_any_is_marked_without_a_motion_to_compare(tmp_path, step, doubted):
    run = stroke(0.02)
    clock = np.arange(len(run.time)) * step
    draft = drafted_columns(tmp_path, {"time [s]": clock, "pos [mm]": 1e3 * run.travel})
    assert draft.checked("time") is doubted
    assert ("Hz" in draft.said("time")) is doubted


@pytest.mark.parametrize(
    ("name", "confirmed"), [("load cell [N]", None), ("load cell", False), ("load cell [kg]", None), ("F_cell_N", None)]
)
def test_a_force_in_a_guessed_unit_is_not_confirmed(tmp_path, name, confirmed):
    run = stroke()
    draft = drafted_columns(tmp_path, {"t [s]": run.time, "pos [m]": run.travel, name: 100.0 * np.abs(run.speed)})
    assert draft.channels["force"].get("unit_confirmed") is confirmed


@pytest.mark.parametrize(("jitter", "unit"), [(0.0, "ms"), (0.1, "s")])
def test_a_clock_that_jitters_is_not_that_of_a_fast_drive(tmp_path, jitter, unit):
    """Steps of 0.1: 10 kHz in ms, or 10 Hz in s, without a speed that would decide."""
    run, noise = stroke(), np.random.default_rng(5)
    time = np.cumsum(0.1 * (1.0 + jitter * noise.uniform(-1.0, 1.0, len(run.time))))
    draft = drafted_columns(tmp_path, {"time": time, "pos": run.travel})
    assert draft.channels["time"]["unit"] == unit and draft.checked("time")


@pytest.mark.parametrize(
    ("whole", "rest"),
    [
        ("time_sec", "time_nsec"),
        ("sec", "nsec"),
        ("secs", "nsecs"),
        ("stamp_sec", "stamp_nanosec"),
        ("header.stamp.sec", "header.stamp.nanosec"),
        ("t_seconds", "t_nanoseconds"),
    ],
)
@pytest.mark.parametrize("since", [0.3, 1_764_380_000.3])
def test_seconds_and_nanoseconds_of_a_stamp_are_one_clock(tmp_path, whole, rest, since):
    """With a jittering clock: the nanoseconds alone start again 2 or 3 times in the log."""
    run = stroke()
    jitter = np.random.default_rng(2).uniform(-1e-4, 1e-4, len(run.time))
    parts = [divmod(int(1e9 * (step + 0.3)), 10**9) for step in run.time + jitter]
    columns = {
        whole: np.array([float(int(since) + part[0]) for part in parts]),
        rest: np.array([float(part[1]) for part in parts]),
        "pos [m]": run.travel,
        "vel [m/s]": run.speed,
    }
    log = tmp_path / "log.csv"
    np.savetxt(log, np.column_stack(list(columns.values())), "%.12g", ",", header=",".join(columns), comments="")
    draft = drafted(log, tmp_path)
    assert draft.channels["time"] == {"column": whole, "unit": "s", "nanoseconds": rest}
    recording = cdtool.read(log, tmp_path / "machine.toml")
    expected = run.time + jitter - (run.time + jitter)[0]
    assert recording["position"].time - recording["position"].time[0] == pytest.approx(expected, abs=2e-9)
