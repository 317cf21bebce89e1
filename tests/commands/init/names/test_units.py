"""`cdtool init`: stated units, marked guesses, and the ratio of position to speed."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.recordings.units import find_unit
from tests.commands.init.drafts import RPM, drafted, drafted_columns, stroke, write
from tests.data_folder import data, needs_data

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


@pytest.mark.parametrize("column", ["t", "Zeit", "timestamp"])
def test_a_clock_without_a_unit_is_marked_even_where_the_guess_is_right(tmp_path, column):
    run = stroke()
    draft = drafted_columns(tmp_path, {column: run.time, "n": run.speed * 100.0})
    assert draft.channels["time"]["unit"] == "s" and draft.checked("time")


@pytest.mark.parametrize("column", ["time_s", "t [s]"])
def test_a_clock_whose_header_names_the_unit_is_not_marked(tmp_path, column):
    run = stroke()
    draft = drafted_columns(tmp_path, {column: run.time, "pos [m]": run.travel, "vel [m/s]": run.speed})
    assert draft.channels["time"]["unit"] == "s" and not draft.checked("time")


def test_a_clock_whose_name_contradicts_the_ratio_is_marked(tmp_path):
    run = stroke(0.05, 40.0)
    draft = drafted_columns(tmp_path, {"time_ms": run.time, "pos [m]": run.travel, "vel [m/s]": run.speed})
    assert draft.checked("time") and "ms" in draft.said("time")


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


def test_a_motors_angle_and_the_speed_of_its_load_give_the_ratio(tmp_path):
    run = stroke()
    columns = {"t [s]": run.time, "motor_angle [rad]": run.travel / LEAD, "leaf_speed [mm/s]": run.speed * 1e3}
    draft = drafted_columns(tmp_path, columns)
    assert draft.machine["transmission_ratio"] == pytest.approx(LEAD, rel=2e-3)
    assert draft.unit("position") == "rad" and draft.unit("speed") == "mm/s"


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


def test_a_torque_in_the_header_is_never_drafted_as_a_force(tmp_path):
    run = stroke()
    columns = {"t [ms]": run.time * 1e3, "pos [mm]": run.travel * 1e3, "vel [mm/s]": run.speed * 1e3}
    draft = drafted_columns(tmp_path, {**columns, "torque [mNm]": run.torque * 1e3})
    assert draft.unit("torque") == "mNm" and draft.machine["coordinates"] == "motor"


def test_header_units_that_the_ratio_contradicts_are_marked(tmp_path):
    run = stroke()
    columns = {"t [s]": run.time, "pos [mm]": run.travel * 1e3, "vel [m/s]": run.speed * 0.8}
    draft = drafted_columns(tmp_path, columns)
    assert draft.unit("speed") == "m/s" and "1.25 of the speed, not 1" in draft.said("speed")


def test_a_ratio_near_that_of_units_does_not_match_them(tmp_path):
    run = stroke()
    counts = np.round(run.travel * 1.024e4)
    draft = drafted_columns(tmp_path, {"t": run.time, "speed_percent": run.speed * 10.0, "pos_count": counts})
    assert (draft.unit("position"), draft.unit("speed")) == ("count", "%")
    assert draft.checked("position") and draft.checked("speed")


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


@pytest.mark.parametrize(
    ("names", "factors"),
    [(("travel", "velocity"), (7.0, 420.0)), (("angle", "angular velocity"), (9.0, 540.0)), (("Weg", "v"), (9e3, 9.0))],
    ids=["mm and mm/min, or m and m/min", "deg and deg/min, or rev and rpm", "um and mm/s, or mm and m/s"],
)
def test_a_ratio_of_units_of_any_size_is_not_certain(tmp_path, names, factors):
    run = stroke()
    columns = {"t [s]": run.time, names[0]: factors[0] * run.travel, names[1]: factors[1] * run.speed}
    draft = drafted_columns(tmp_path, columns)
    assert draft.checked("position") and draft.checked("speed")


@needs_data("ur3e/L1L2.csv")
def test_a_complete_clock_is_taken_rather_than_a_counter_with_empty_cells(tmp_path):
    draft = drafted(data("ur3e/L1L2.csv"), tmp_path)
    assert draft.channels["time"] == {"column": "timestamp", "unit": "s"}
    assert "nan" not in draft.text and draft.unit("position") == "rad"


def test_a_clock_with_empty_cells_gives_way_to_a_complete_one(tmp_path):
    run = stroke()
    path = write(tmp_path / "log.csv", {"time": np.arange(4000.0), "timestamp": run.time, "n": run.speed * 100.0})
    lines = path.read_text().splitlines()
    lines[2000] = "," + lines[2000].split(",", 1)[1]
    path.write_text("\n".join(lines) + "\n")
    assert drafted(path, tmp_path).channels["time"]["column"] == "timestamp"


@pytest.mark.parametrize("column", ["time [s]", "时间(s)"])
def test_a_clock_whose_header_states_seconds_but_counts_milliseconds_is_marked(tmp_path, column):
    run = stroke()
    draft = drafted_columns(
        tmp_path, {column: 1e3 * run.time, "pos [mm]": 1e3 * run.travel, "vel [mm/s]": 1e3 * run.speed}
    )
    assert draft.channels["time"]["unit"] == "s" and draft.checked("time")
    assert "ms with mm, mm/s fits the ratio, s does not" in draft.said("time")


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
