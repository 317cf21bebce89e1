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
