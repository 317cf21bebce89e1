"""`cdtool init`: what the values say against names, units and shapes."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool import init, init_study
from cdtool.commands.init import motion_evidence as motion
from cdtool.commands.init.stream import Stream
from tests.commands.init.drafts import drafted, drafted_columns, stroke
from tests.data_folder import data, needs_data


def stream(time, values, name="x"):
    return Stream(name, (name,), None, time, values[:, np.newaxis])


@settings(max_examples=25, deadline=None)
@given(ahead=st.floats(-8.0, 8.0).filter(lambda value: abs(value) > 0.5), gain=st.floats(0.2, 5.0))
def test_the_lead_of_a_set_value_is_found(ahead, gain):
    time = np.arange(3000) * 2e-3
    one = stream(time, np.sin(3.0 * time) + 0.4 * np.sin(7.0 * time))
    shifted = time + ahead * 2e-3
    other = stream(time, gain * (np.sin(3.0 * shifted) + 0.4 * np.sin(7.0 * shifted)) + 1.0)
    assert motion.lead(one, other) == pytest.approx(ahead, rel=0.1, abs=0.1)


def test_a_unit_is_used_where_the_name_says_nothing(tmp_path):
    run = stroke()
    draft = drafted_columns(
        tmp_path,
        {"t [s]": run.time, "CH 1 [mm]": run.travel * 1e3, "CH 2 [mm/s]": run.speed * 1e3, "CH 3 [N]": run.force,
         "CH 4 [m/s²]": np.gradient(run.speed, run.time)},
    )  # fmt: skip
    columns = {name: part["column"] for name, part in draft.channels.items() if name != "time"}
    assert columns == {
        "position": "CH 1 [mm]", "speed": "CH 2 [mm/s]", "force": "CH 3 [N]", "acceleration": "CH 4 [m/s²]",
    }  # fmt: skip


@pytest.mark.parametrize("name", ["computed_torque", "model_torque", "torque_target"])
def test_a_modelled_effort_is_no_measured_one(tmp_path, name):
    run = stroke()
    draft = drafted_columns(tmp_path, {"t": run.time, "pos": run.travel, "vel": run.speed, name: run.torque})
    assert "torque" not in draft.channels
    assert any(name in item.columns for item in draft.done.unmapped) is ("target" not in name)


def test_a_speed_that_the_position_does_not_follow_is_left_out_with_the_reason(tmp_path):
    run = stroke()
    other = np.sin(3.0 * run.time)
    columns = {"t [s]": run.time, "pos [m]": run.travel, "vel [m/s]": other}
    draft = drafted_columns(tmp_path, columns, left_out=("speed",))
    assert "left out: it does not follow the derivative of the position" in " ".join(draft.text.split("\n# "))


def test_a_reversed_speed_is_recognised_and_marked(tmp_path):
    run = stroke()
    columns = {
        "t [s]": run.time,
        "pos a [m]": run.travel,
        "vel b [m/s]": np.sin(3.0 * run.time),
        "vel c [m/s]": -run.speed,
    }
    draft = drafted_columns(tmp_path, columns)
    assert draft.channels["speed"]["column"] == "vel c [m/s]"
    assert "opposite in sign" in draft.said("speed") and draft.checked("position")


@pytest.mark.parametrize(("step", "expected"), [(1e-3, 22.0), (1e-2, 4.7)])
def test_the_low_pass_of_a_derived_speed_follows_from_the_steps_of_the_position(tmp_path, step, expected):
    """The corner where quantisation noise is 1 % of the largest speed: (3 (0.01 v)^2 / (8 pi^2 T s^2))^(1/3)."""
    run = stroke(period=5e-3)
    draft = drafted_columns(tmp_path, {"t [s]": run.time, "pos [m]": np.round(run.travel / step) * step})
    noise = step / np.sqrt(12.0)
    corner = (3.0 * 0.01**2 / (8.0 * np.pi**2 * 5e-3 * noise**2)) ** (1.0 / 3.0)
    assert draft.channels["speed_low_pass_hz"] == pytest.approx(corner, rel=0.1) == pytest.approx(expected, rel=0.1)
    assert draft.checked("speed_low_pass_hz")


def test_a_fine_position_or_a_logged_speed_needs_no_low_pass(tmp_path):
    run = stroke()
    fine = drafted_columns(tmp_path, {"t [s]": run.time, "pos [m]": run.travel})
    logged = drafted_columns(tmp_path, {"t [s]": run.time, "pos [m]": np.round(run.travel, 2), "vel [m/s]": run.speed})
    assert "speed_low_pass_hz" not in fine.channels and "speed_low_pass_hz" not in logged.channels


@needs_data("ur3/id1.bag")
def test_the_sign_of_a_real_robots_torque_is_reversed_with_the_reason(tmp_path):
    """The log has the torque that the load exerts on the drive; the motion of two joints is too small to show it."""
    draft = drafted(data("ur3/id1.bag"), tmp_path)
    assert draft.channels["torque"]["scale"] == -1.0
    assert "gives power to the machine where friction takes it" in draft.said("torque")


@needs_data("ur3/id1.bag")
def test_a_sign_that_the_first_log_does_not_show_is_found_in_the_others(tmp_path):
    bags = sorted(data("ur3").glob("*.bag"))
    assert init(bags[0], tmp_path / "first.toml").text.count("scale = -1.0") == 0
    init_study(bags, tmp_path / "study")
    assert "scale = -1.0" in (tmp_path / "study" / "machine.toml").read_text(encoding="utf-8")


@needs_data("ur_collisions/onsets.csv")
@pytest.mark.parametrize("name", ["Drift00_NF_1", "Drift00_WF_1", "Drift60_NF_3"])
def test_an_angle_without_a_name_is_known_by_the_circle_of_its_tool(tmp_path, name):
    """Column 8, a coordinate of the tool, is nearly the derivative of column 7; neither is that of a joint."""
    draft = drafted(data(f"ur_collisions/{name}.csv"), tmp_path)
    assert draft.channels["position"] == {"column": 1, "unit": "deg"} and draft.checked("position")
    assert draft.channels["torque"]["column"] == 13 and draft.checked("torque")
    assert draft.machine["type"] == "rotary_axis" and not {"speed", "force"} & draft.channels.keys()


@needs_data("cnc_mill/experiment_01.csv")
def test_row_numbers_are_no_clock_in_milliseconds(tmp_path):
    """Steps of 0.1 s follow from position and speed; neither states its unit."""
    draft = drafted(data("cnc_mill/experiment_01.csv"), tmp_path)
    assert draft.channels["time"] == {"column": 0, "rate_hz": pytest.approx(10.0, rel=0.01)} and draft.checked("time")
    assert (draft.unit("position"), draft.unit("speed")) == ("deg", "deg/s") and draft.checked("position")


@needs_data("ur10e_motions/ur-20_01_17-p1.csv")
def test_noise_of_an_encoder_is_no_load_cell(tmp_path):
    """A robot at rest: nothing tells its columns apart."""
    draft = drafted(data("ur10e_motions/ur-20_01_17-p1.csv"), tmp_path)
    assert draft.channels.keys() == {"time"}
