"""`cdtool init`: the column guessed for each channel, by its name and despite its values."""

from __future__ import annotations

import numpy as np
import pytest

from tests.commands.init.drafts import drafted, drafted_columns, stroke
from tests.data_folder import data, needs_data


def column(draft, channel):
    return draft.channels[channel].get("column")


def columns_of(draft):
    return {column(draft, channel) for channel in draft.done.channels}


def following_error(run, size):
    noise = np.random.default_rng(2).normal(0.0, 0.01, len(run.time))
    return size * run.speed + size * np.convolve(noise, np.ones(5) / 5.0, "same")


@pytest.mark.parametrize("word", ["Schleppfehler", "following_error", "lag", "Regelabweichung", "speed deviation"])
def test_a_following_error_is_not_a_channel(tmp_path, word):
    run = stroke()
    noise = np.random.default_rng(3).normal(0.0, 0.005, len(run.time))
    draft = drafted_columns(
        tmp_path,
        {
            "Zeit": run.time, "Position Ist": run.travel, "Drehzahl Ist": run.speed * 60.0 + noise,
            "Strom": run.torque, word: following_error(run, 0.9),
        },
    )  # fmt: skip
    assert column(draft, "speed") == "Drehzahl Ist" and column(draft, "position") == "Position Ist"
    assert word not in columns_of(draft) and "reference_speed" not in draft.channels


def test_a_name_for_a_measured_value_is_never_a_set_value(tmp_path):
    run = stroke()
    noise = np.random.default_rng(3).normal(0.0, 0.005, len(run.time))
    draft = drafted_columns(
        tmp_path, {"t": run.time, "actual_speed": run.speed, "mystery": run.speed + noise, "pos": run.travel}
    )
    assert column(draft, "speed") == "actual_speed" and "reference_speed" not in draft.channels


def test_an_unnamed_column_does_not_replace_a_named_one(tmp_path):
    run = stroke()
    noise = np.random.default_rng(3).normal(0.0, 0.005, len(run.time))
    draft = drafted_columns(tmp_path, {"t": run.time, "speed": run.speed, "mystery": run.speed + noise})
    assert column(draft, "speed") == "speed"


def test_the_smoother_of_two_equally_named_columns_is_the_set_value(tmp_path):
    run = stroke()
    noise = np.random.default_rng(3).normal(0.0, 0.005, len(run.time))
    draft = drafted_columns(tmp_path, {"t": run.time, "speed a": run.speed, "speed b": run.speed + noise})
    assert column(draft, "speed") == "speed b" and column(draft, "reference_speed") == "speed a"
    assert "values only" in draft.said("speed") and "values only" in draft.said("reference_speed")


@pytest.mark.parametrize("cell", ["loadcell_N", "load cell", "Kraftmessdose", "Waegezelle", "F_cell", "Kraft", "F"])
def test_a_load_cell_never_becomes_the_torque(tmp_path, cell):
    """Its values are those of a drive here, so that only the name excludes it."""
    run = stroke()
    draft = drafted_columns(tmp_path, {"t": run.time, "pos": run.travel, "vel": run.speed, cell: run.torque * 100.0})
    assert column(draft, "force") == cell and "torque" not in draft.channels


@pytest.mark.parametrize(
    "drive", ["force_drive_N", "driveforce", "drive_force [N]", "Antriebskraft", "Kraft_Antrieb_N"]
)
def test_the_drives_force_is_the_torque_next_to_a_load_cell(tmp_path, drive):
    run = stroke()
    draft = drafted_columns(
        tmp_path,
        {"time_s": run.time, "velocity_mps": run.speed, drive: run.torque * 700.0, "position_m": run.travel,
         "loadcell_N": run.force},
    )  # fmt: skip
    assert column(draft, "torque") == drive and column(draft, "force") == "loadcell_N"
    assert draft.unit("torque") == "N" and draft.unit("force") == "N"


def test_an_unnamed_column_with_rest_and_peaks_is_not_a_torque(tmp_path):
    run = stroke()
    path = tmp_path / "log.csv"
    np.savetxt(path, np.column_stack((run.time, run.travel, run.speed, run.force)), delimiter=",")
    draft = drafted(path, tmp_path)
    assert "torque" not in draft.channels and column(draft, "force") == 3


def test_a_unit_at_the_end_of_a_name_is_not_a_channel(tmp_path):
    run = stroke()
    pulses = np.where(run.time > 2.0, 5.0, 0.0)
    draft = drafted_columns(tmp_path, {"t": run.time, "x": run.travel, "pulses_N": pulses, "tau_m": run.torque})
    assert "speed" not in draft.channels and column(draft, "torque") == "tau_m"


def test_a_header_unit_keeps_a_column_from_what_it_cannot_measure(tmp_path):
    run = stroke()
    draft = drafted_columns(tmp_path, {"t [s]": run.time, "v [mm]": run.speed, "pos": run.travel})
    assert column(draft, "position") == "pos" and "speed" not in draft.channels


@needs_data("emps/DATA_EMPS_PULSES.mat")
def test_the_shaker_of_a_bench_is_not_a_speed_of_rotation(tmp_path):
    draft = drafted(data("emps/DATA_EMPS_PULSES.mat"), tmp_path)
    assert "speed" not in draft.channels and column(draft, "position") == "qm" and draft.checked("position")
    assert "values only" in draft.said("torque")


def test_joints_numbered_with_gaps_are_joints_if_several_quantities_have_the_same_numbers(tmp_path):
    run = stroke()
    columns = {"time [s]": run.time}
    for name, values in (("ENC_POS", run.travel), ("SPEED", run.speed), ("TORQUE", run.torque)):
        columns |= {f"{name}|{number}": (k + 1.0) * values for k, number in enumerate((1, 2, 6))}
    draft = drafted_columns(tmp_path, columns)
    assert draft.channels["position"]["columns"] == ["ENC_POS|1", "ENC_POS|2", "ENC_POS|6"]
    assert draft.channels["torque"]["columns"] == ["TORQUE|1", "TORQUE|2", "TORQUE|6"]


def test_two_motors_of_one_axis_are_not_two_joints(tmp_path):
    run = stroke()
    draft = drafted_columns(
        tmp_path,
        {
            "t [s]": run.time, "pos [mm]": 1e3 * run.travel, "vel [mm/s]": 1e3 * run.speed,
            "motor 1 current [A]": run.torque, "motor 2 current [A]": 0.9 * run.torque + 0.01,
        },
    )  # fmt: skip
    assert column(draft, "position") == "pos [mm]" and column(draft, "torque").startswith("motor")


def test_clocks_inside_of_groups_are_no_channels(tmp_path):
    run = stroke()
    draft = drafted_columns(
        tmp_path,
        {
            "/'Force [N]'/'Time'": run.time, "/'Force [N]'/'cell [N]'": run.force,
            "/'Travel [mm]'/'Time'": run.time, "/'Travel [mm]'/'G1 [mm]'": 1e3 * run.travel,
            "/'Speed [mm/s]'/'Time'": run.time, "/'Speed [mm/s]'/'V1 [mm/s]'": 1e3 * run.speed,
        },
    )  # fmt: skip
    assert column(draft, "time").endswith("'Time'")
    assert column(draft, "position").endswith("'G1 [mm]'") and column(draft, "speed").endswith("'V1 [mm/s]'")


def test_a_flag_is_no_acceleration_whatever_its_name(tmp_path):
    run = stroke()
    flag = (run.speed > 0.5).astype(float)
    draft = drafted_columns(tmp_path, {"t [s]": run.time, "pos [m]": run.travel, "vel [m/s]": run.speed, "acc": flag})
    assert "acceleration" not in draft.channels


def test_a_set_value_is_not_the_missing_measured_speed(tmp_path):
    run = stroke()
    draft = drafted_columns(tmp_path, {"t [s]": run.time, "pos [m]": run.travel, "cmd_speed": run.speed})
    assert "speed" not in draft.channels


def test_the_speed_in_metres_per_second_is_taken_before_an_electrical_one(tmp_path):
    run = stroke()
    draft = drafted_columns(
        tmp_path,
        {
            "ms_today": np.round(1e3 * run.time), "erpm": 4e3 * run.speed,
            "encoder_position": np.mod(7e3 * run.travel, 360.0),
            "speed_meters_per_sec": run.speed, "tacho_meters": run.travel,
        },
    )  # fmt: skip
    assert column(draft, "speed") == "speed_meters_per_sec" and draft.unit("speed") == "m/s"
    assert column(draft, "position") == "tacho_meters" and draft.unit("position") == "m"


def test_the_effort_with_the_sign_of_the_torque_is_taken_before_one_of_like_size(tmp_path):
    run = stroke()
    rectified = np.abs(run.torque) * np.where(run.time > 2.0, -1.0, 1.0)
    draft = drafted_columns(
        tmp_path,
        {
            "t [s]": run.time, "pos [m]": run.travel, "vel [m/s]": run.speed,
            "current_motor": rectified, "q_axis_current": run.torque,
        },
    )  # fmt: skip
    assert column(draft, "torque") == "q_axis_current"


def test_measured_and_interpolated_positions_are_known_by_two_letters(tmp_path):
    run = stroke()
    columns = {"time": run.time}
    for name, values in (("mp", run.travel), ("ip", np.roll(run.travel, -3)), ("mt", run.torque)):
        columns |= {f"{name}{j}": j * values for j in (1, 2)}
    columns["ip1"][-3:] = columns["ip1"][-4]
    columns["ip2"][-3:] = columns["ip2"][-4]
    draft = drafted_columns(tmp_path, columns)
    assert draft.channels["position"]["columns"] == ["mp1", "mp2"]
    assert draft.channels["torque"]["columns"] == ["mt1", "mt2"]
    assert draft.channels["reference_position"]["columns"] == ["ip1", "ip2"]


def test_the_same_position_in_counts_is_no_set_value(tmp_path):
    run = stroke()
    draft = drafted_columns(
        tmp_path,
        {
            "t [s]": run.time, "speed [m/s]": run.speed, "pos [m]": np.round(run.travel, 3),
            "motor current [A]": run.torque, "tachometer": np.floor(6631.6 * run.travel),
        },
    )  # fmt: skip
    assert column(draft, "position") == "pos [m]" and "reference_position" not in draft.channels
