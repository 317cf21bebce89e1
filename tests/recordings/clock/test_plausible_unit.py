"""A clock whose values contradict its unit is refused, or a warning states both readings; a valid clock is accepted."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cdtool.base.errors import RecordingError
from cdtool.commands.judging.information import info
from cdtool.formats.channels.reading import read_recording
from cdtool.formats.machine_file import read_machine_file
from cdtool.recordings.clock.plausible_unit import contradicted_by_epoch, contradicted_by_steps
from tests.base.findings.facts import fact_of
from tests.data_folder import data, needs_data

MACHINE = """
[machine]
type = "linear_axis"
name = "gate"
coordinates = "load"
load_mass = 620.0

[channels]
time = {{ column = "{column}", unit = "{unit}" }}
position = {{ column = "x", unit = "m" }}
"""
EPOCHS = {"s": 1.6e9, "ms": 1.6e12, "us": 1.6e15}
ONE = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}
# The findings on a clock whose unit cannot be right.
WRONG_UNIT = ("clock_unit_contradicted", "file_unit_implausible", "header_unit_implausible", "steps_implausible")


def log(folder: Path, header: str, stamps: np.ndarray, name: str = "log.csv") -> Path:
    path = folder / name
    rows = "".join(f"{stamp:.6f};{0.001 * k:.4f}\n" for k, stamp in enumerate(stamps))
    path.write_text(f"{header};x\n{rows}")
    return path


def read(folder: Path, header: str, unit: str, stamps: np.ndarray):
    path = folder / "machine.toml"
    path.write_text(MACHINE.format(column=header, unit=unit))
    return read_recording(log(folder, header, stamps), read_machine_file(path))


@pytest.mark.parametrize(("meant", "stated"), [("ms", "s"), ("us", "s"), ("us", "ms")])
def test_stamps_since_1970_that_cannot_be_in_the_stated_unit_are_refused_with_both_readings(tmp_path, meant, stated):
    stamps = EPOCHS[meant] + np.arange(40) * 1e-3 / ONE[meant]
    with pytest.raises(RecordingError) as fault:
        read(tmp_path, f"Time [{stated}]", stated, stamps)
    text = fault.value.message
    assert "log.csv: the machine file states" in text and f"its header says 'Time [{stated}]'" in text
    assert f"years in {stated}, and 2020-09-13 in {meant} since 1970" in text
    assert fault.value.hint == f'write time = {{ column = "Time [{stated}]", unit = "{meant}" }} in [channels]'
    assert "Traceback" not in text and "\n" not in text


def test_info_without_a_machine_file_uses_the_only_possible_unit_and_warns(tmp_path):
    shown = info(log(tmp_path, "Time [sec]", 1.6e12 + np.arange(2000.0)))
    assert [channel.rate_hz for channel in shown.channels] == [pytest.approx(1000.0, rel=1e-3)] * len(shown.channels)
    (warning,) = [item for item in shown.findings if item.severity == "warning"]
    readings = {
        "stamp": 1.6e12,
        "stated": "sec",
        "years": pytest.approx(50702.0, abs=0.5),
        "meant": "ms",
        "day": "2020-09-13",
    }
    assert fact_of(warning) == ("header_unit_implausible", {"readings": readings}) and warning.channel == "Time [sec]"


@pytest.mark.parametrize(("step", "unit", "likely"), [(1e3, "s", "us"), (1e6, "s", "ns"), (1.0, "ns", "ms")])
def test_implausible_steps_are_a_warning_with_both_readings(tmp_path, step, unit, likely):
    recording = read(tmp_path, f"t [{unit}]", unit, step * np.arange(40))
    (fact,) = [fact_of(item) for item in recording.findings if item.kind == "steps_implausible"]
    rate = 1.0 / (step * ONE[likely])
    assert (fact.numbers["stated"], fact.numbers["header"], fact.numbers["likely"]) == (unit, f"t [{unit}]", likely)
    assert (fact.numbers["step"], fact.numbers["rate"]) == (pytest.approx(step * ONE[unit]), pytest.approx(rate))


@pytest.mark.parametrize(
    ("first", "step", "unit"),
    [
        (0.0, 1.0, "s"),  # a log at 1 Hz
        (0.0, 10.0, "s"),
        (0.0, 1.0, "ms"),
        (1.6e9, 0.001, "s"),
        (1.6e9, 1.0, "ms"),  # 18 days since power-on
        (1.6e12, 1000.0, "us"),  # the same
        (1.6e15, 1e6, "ns"),
        (3.85e9, 0.01, "s"),  # since 1904
        (6.4e10, 0.01, "s"),  # since the year 0
        (1.6e18, 1e6, "ns"),
    ],
)
def test_a_valid_clock_is_accepted_without_a_warning(first, step, unit):
    stamps = first + step * np.arange(100)
    assert contradicted_by_epoch(first, ONE[unit]) == ""
    assert contradicted_by_steps(stamps, ONE[unit])[0] == ""


@pytest.mark.parametrize("name", [pytest.param(name, marks=needs_data(name)) for name in ("ur3e", "emps")])
def test_no_real_recording_has_a_warning(name):
    for path in [path for path in sorted(data(name).rglob("*")) if path.suffix in (".csv", ".mat")][:2]:
        shown = info(path)
        assert not [item for item in shown.findings if item.kind in WRONG_UNIT], path


def test_a_container_clock_that_contradicts_its_attribute_is_read_in_the_only_possible_unit_with_a_warning(tmp_path):
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "log.h5"
    with h5py.File(path, "w") as file:
        file["drive/time"] = 1_600_000_000_000 + np.arange(50)
        file["drive/time"].attrs["unit"] = "s"
        file["drive/pos"] = 0.001 * np.arange(50)
        file["drive/pos"].attrs["unit"] = "m"
    machine = tmp_path / "machine.toml"
    machine.write_text(MACHINE.format(column="time", unit="s").replace('"x"', '"drive/pos"'))
    recording = read_recording(path, read_machine_file(machine))
    assert recording.duration == pytest.approx(0.049)
    (fact,) = [fact_of(item) for item in recording.findings if item.kind in WRONG_UNIT]
    assert fact == (
        "file_unit_implausible",
        {
            "readings": {
                "stamp": 1.6e12,
                "stated": "s",
                "years": pytest.approx(50702.0, abs=0.5),
                "meant": "ms",
                "day": "2020-09-13",
            }
        },
    )
