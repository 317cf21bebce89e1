"""`cdtool init`: the column guessed for each channel, by its name and despite its values."""

from __future__ import annotations

import numpy as np
import pytest

from tests.commands.init.drafts import drafted, drafted_columns, stroke
from tests.data_folder import data, needs_data


def signals():
    """Return the signals of a stroke by name; a following error, noise on the speed, a pressure of the contact."""
    run, noise = stroke(), np.random.default_rng(3).normal(0.0, 0.005, (3, 4000))
    late = 0.9 * run.speed + np.convolve(noise[0], np.ones(5) / 5.0, "same")
    push = np.where((run.time > 1.0) & (run.time < 1.3), 200.0 * np.sin(np.pi * (run.time - 1.0) / 0.3), 0.0)
    return {
        "time": run.time, "travel": run.travel, "speed": run.speed, "noisy": run.speed + noise[1],
        "torque": run.torque, "cell": run.force, "error": late, "push": push, "pressure": 0.5 * push + noise[2],
    }  # fmt: skip


# The signal of each column, and the column of each channel but the clock.
AXIS = {"t": "time", "pos": "travel", "vel": "speed"}
RIG = {"t [s]": "time", "n [rad/s]": "speed", "i [A]": "torque", "load_cell [N]": "push"}
OF_RIG = {"speed": "n [rad/s]", "torque": "i [A]", "force": "load_cell [N]"}
ERRORS = ("Schleppfehler", "following_error", "lag", "Regelabweichung", "speed deviation")
CELLS = ("loadcell_N", "load cell", "Kraftmessdose", "Waegezelle", "F_cell", "Kraft", "F")
DRIVES = ("force_drive_N", "driveforce", "drive_force [N]", "Antriebskraft", "Kraft_Antrieb_N")
PRESSURES = ("contact pressure [N/cm²]", "Spitzendruck [MPa]", "Flächenpressung (kPa)", "film 1 [N/cm2]")
OTHERS = ("hydraulic pressure [bar]", "Druck [bar]", "oil [kPa]", "contact pressure", "level [N]")
CASES = [
    *(
        (
            {"Zeit": "time", "Position Ist": "travel", "Drehzahl Ist": "noisy", "Strom": "torque", word: "error"},
            {"position": "Position Ist", "speed": "Drehzahl Ist", "torque": "Strom"},
        )
        for word in ERRORS
    ),
    # The name of a measured value is never a set value; of equal names the smoother signal is.
    (
        {"t": "time", "actual_speed": "speed", "mystery": "noisy", "pos": "travel"},
        {"speed": "actual_speed", "position": "pos"},
    ),
    ({"t": "time", "speed a": "speed", "speed b": "noisy"}, {"speed": "speed b", "reference_speed": "speed a"}),
    (
        {"t [s]": "time", "pos [m]": "travel", "cmd_speed": "speed"},
        {"position": "pos [m]", "reference_speed": "cmd_speed"},
    ),
    # The values of a load cell may be those of a drive, so that only the name excludes it.
    *((AXIS | {cell: "torque"}, {"position": "pos", "speed": "vel", "force": cell}) for cell in CELLS),
    *(
        (
            {"time_s": "time", "velocity_mps": "speed", drive: "torque", "position_m": "travel", "loadcell_N": "cell"},
            {"speed": "velocity_mps", "torque": drive, "position": "position_m", "force": "loadcell_N"},
        )
        for drive in DRIVES
    ),
    # The pressure of a contact is a channel of its own; that of oil or air, or one without a unit, is none.
    *((RIG | {name: "pressure"}, OF_RIG | {"contact_pressure": name}) for name in PRESSURES),
    *((RIG | {name: "pressure"}, OF_RIG) for name in OTHERS),
]


@pytest.mark.parametrize(("columns", "expected"), CASES, ids=[", ".join(columns) for columns, _ in CASES])
def test_columns_become_channels_by_their_names(tmp_path, columns, expected):
    known = signals()
    draft = drafted_columns(tmp_path, {name: known[signal] for name, signal in columns.items()})
    found = {channel: part["column"] for channel, part in draft.channels.items() if channel in draft.done.channels}
    assert {channel: name for channel, name in found.items() if channel != "time"} == expected


def test_an_unnamed_column_with_rest_and_peaks_is_not_a_torque(tmp_path):
    run = stroke()
    path = tmp_path / "log.csv"
    np.savetxt(path, np.column_stack((run.time, run.travel, run.speed, run.force)), delimiter=",")
    draft = drafted(path, tmp_path)
    assert "torque" not in draft.channels and draft.channels["force"]["column"] == 3


@needs_data("emps/DATA_EMPS_PULSES.mat")
def test_the_shaker_of_a_bench_is_not_a_speed_of_rotation(tmp_path):
    draft = drafted(data("emps/DATA_EMPS_PULSES.mat"), tmp_path)
    assert "speed" not in draft.channels and draft.channels["position"]["column"] == "qm" and draft.checked("position")
    assert "values only" in draft.said("torque")
