"""Load cells in files beside the log: found by name, aligned by trigger, offset or epoch, or absent with the reason."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import ConfigurationError
from cdtool.formats.channels.reading import read_as_logged
from cdtool.formats.machine_file import MachineFile, read_machine_file
from cdtool.formats.mcap.write import Stream, write_mcap
from cdtool.recordings.recording import Recording, Series
from cdtool.truth.onset import OnsetRule, find_contacts
from tests.base.findings.facts import fact_of

AXIS = '[machine]\ntype = "linear_axis"\ncoordinates = "load"\nload_mass = 10.0\n'
LOG = '[channels]\ntime = { column = "t", unit = "s" }\nspeed = { column = "v", unit = "m/s" }\n'
CELL = 'file = "cell_{stem}.csv", column = "F", unit = "N", time = { column = "time", unit = "ms" }'
TRIGGER = 'trigger = { log = "sync", file = "trig" }'
EPOCH = 1_743_681_600.0


def machine(folder: Path, align: str, cell: str = CELL, section: str = LOG) -> MachineFile:
    path = folder / "machine.toml"
    path.write_text(f"{AXIS}{section}force = {{ {cell}, {align} }}\n", encoding="utf-8")
    return read_machine_file(path)


def table(names: str, *columns: FloatArray) -> str:
    rows = (
        ",".join(f"{value:.9g}" if abs(value) < 1e6 else f"{value:.6f}" for value in row)
        for row in zip(*columns, strict=True)
    )
    return "\n".join([names, *rows]) + "\n"


def jittered(start: float, end: float, rate: float, seed: int) -> FloatArray:
    count = int((end - start) * rate)
    return start + (np.arange(count) + 0.4 * np.random.default_rng(seed).uniform(size=count)) / rate


def write_log(folder: Path, ons: tuple[float, ...] = (1.0,), start: float = 0.0, name: str = "03.csv") -> None:
    """Write a log at about 200 Hz from 0 to 4 s whose sync is high for 50 ms from each of `ons` [s] on."""
    time = jittered(0.0, 4.0, 200.0, 1)
    sync = sum((time >= on) & (time < on + 0.05) for on in ons) + np.zeros(len(time))
    (folder / name).write_text(table("t,v,sync", start + time, 0.2 + 0.0 * time, sync), encoding="utf-8")


def write_cell(
    folder: Path, shift: float, ons: tuple[float, ...] = (1.0,), drift: float = 0.0, name: str = "cell_03.csv"
) -> None:
    """Write a cell at about 2 kHz from -0.5 to 4.5 s, whose force is 100 times the log's time; its clock is ahead."""
    time = jittered(-0.5, 4.5, 2000.0, 2)
    trigger = sum(5.0 * ((time >= on) & (time < on + 0.05)) for on in ons)
    trigger = trigger + np.random.default_rng(3).normal(0.0, 0.05, len(time))
    stamps = 1e3 * (time * (1.0 + drift) + shift)
    (folder / name).write_text(table("time,F,trig", stamps, 100.0 * time, trigger), encoding="utf-8")


def read(folder: Path, align: str, **settings: str) -> Recording:
    return read_as_logged(folder / "03.csv", machine(folder, align, **settings)).recording


def facts(recording: Recording, kind: str) -> list:
    return [fact_of(item) for item in recording.findings if item.kind == kind]


@pytest.mark.parametrize("shift", [0.0, 12.3456, -0.2, 5000.0])
def test_a_trigger_in_both_aligns_the_clocks_to_within_a_sample(tmp_path, shift):
    write_log(tmp_path)
    write_cell(tmp_path, shift)
    recording = read(tmp_path, TRIGGER)
    force = recording["force"]
    assert np.abs(force.values[:, 0] / 100.0 - force.time).max() < 0.0075
    assert force.period == pytest.approx(5e-4, rel=0.1)
    assert recording.start <= force.time[0] and force.time[-1] <= recording.end
    (aligned,) = facts(recording, "file_aligned")
    assert aligned.numbers["shift"] == pytest.approx(-shift, abs=0.0075)
    assert aligned.numbers["cut"] > 1500 and aligned.numbers["within"] == recording.truth_clock == pytest.approx(
        5e-3, rel=0.2
    )
    assert "trigger" not in recording
    ((name, digest),) = recording.beside
    assert name == "cell_03.csv" and len(digest) == 64


def test_a_pressure_sensor_has_a_file_too_whose_clock_does_not_concern_a_latency(tmp_path):
    write_log(tmp_path)
    write_cell(tmp_path, 12.3)
    cell = CELL.replace('unit = "N"', 'unit = "bar"')
    path = tmp_path / "machine.toml"
    path.write_text(f"{AXIS}{LOG}contact_pressure = {{ {cell}, {TRIGGER} }}\n", encoding="utf-8")
    recording = read_as_logged(tmp_path / "03.csv", read_machine_file(path)).recording
    pressure = recording["contact_pressure"]
    assert pressure.unit == "Pa" and np.abs(1e-7 * pressure.values[:, 0] - pressure.time).max() < 0.0075
    assert recording.truth_clock == 0.0 and facts(recording, "file_aligned")[0].numbers["within"] > 0.0
    (tmp_path / "cell_03.csv").unlink()
    without = read_as_logged(tmp_path / "03.csv", read_machine_file(path)).recording
    assert "contact_pressure" not in without and len(facts(without, "absent_file")) == 1


def test_clocks_that_run_apart_are_reported_and_widen_what_is_known(tmp_path):
    write_log(tmp_path, (0.5, 3.5))
    write_cell(tmp_path, 2.0, (0.5, 3.5), drift=0.01)
    recording = read(tmp_path, TRIGGER)
    (drift,) = facts(recording, "triggers_drift")
    assert drift.numbers["ppm"] == pytest.approx(-1e4, rel=0.25) and drift.numbers["span"] == pytest.approx(
        3.0, abs=0.01
    )
    assert recording.truth_clock > 0.015


def test_different_numbers_of_triggers_are_reported(tmp_path):
    write_log(tmp_path, (1.0, 3.0))
    write_cell(tmp_path, 2.0, (1.0,))
    recording = read(tmp_path, TRIGGER)
    assert facts(recording, "triggers_differ") == [("triggers_differ", {"in_log": 2, "in_file": 1})]
    assert facts(recording, "file_aligned")[0].numbers["shift"] == pytest.approx(-2.0, abs=7.5e-3)


def test_a_stated_offset_is_added_to_the_times_of_the_file(tmp_path):
    write_log(tmp_path)
    write_cell(tmp_path, 0.75)
    recording = read(tmp_path, "time_offset = -0.75")
    force = recording["force"]
    assert np.abs(force.values[:, 0] / 100.0 - force.time).max() < 1e-5
    assert recording.truth_clock == 0.0


def test_an_offset_beside_a_trigger_is_the_delay_of_the_cell(tmp_path):
    write_log(tmp_path)
    write_cell(tmp_path, 2.0)
    plain, late = (read(tmp_path, f"{TRIGGER}{more}")["force"] for more in ("", ", time_offset = -0.1"))
    assert late.values[100, 0] - plain.values[100, 0] == pytest.approx(0.0, abs=100.0)
    assert np.interp(100.0, late.values[:, 0], late.time) == pytest.approx(
        np.interp(100.0, plain.values[:, 0], plain.time) - 0.1
    )


def test_two_clocks_since_1970_are_aligned_by_it(tmp_path):
    write_log(tmp_path, start=EPOCH)
    write_cell(tmp_path, EPOCH)
    recording = read(tmp_path, 'clock = "epoch"')
    force = recording["force"]
    assert np.abs(force.values[:, 0] / 100.0 - force.time - recording.origin + EPOCH).max() < 1e-3


def test_a_missing_file_is_a_note_with_the_path_from_the_log(tmp_path):
    write_log(tmp_path)
    recording = read(tmp_path, TRIGGER)
    (absent,) = [item for item in recording.findings if item.kind == "absent_file"]
    assert absent.severity == "note" and absent.channel == "force"
    assert "'cell_03.csv'" in str(absent)
    assert "force" not in recording and recording.beside == ()


def beside(log: dict, cell: dict, align: str, said: str, name: str = "F") -> tuple:
    """A log and a cell that cannot be aligned: arguments of write_log and write_cell, and the reason that is given."""
    return log, cell, align, said, name


ABSENT = {
    "a trigger that never rises in the log": beside({"ons": ()}, {"shift": 0.0}, TRIGGER, "the log never rises"),
    "a trigger that is noise in the file": beside({}, {"shift": 0.0, "ons": ()}, TRIGGER, "the file never rises"),
    "an offset beyond the log": beside({}, {"shift": 2.0}, f"{TRIGGER}, time_offset = 100.0", "are outside the log"),
    "a trigger that the log has not": beside({}, {"shift": 0.0}, TRIGGER.replace("sync", "synch"), "no column 'synch'"),
    "a log that does not count from 1970": beside(
        {}, {"shift": EPOCH}, 'clock = "epoch"', "the log's clock does not count from 1970"
    ),
    "a file that does not count from 1970": beside(
        {"start": EPOCH}, {"shift": 0.0}, 'clock = "epoch"', "the file's clock does not count from 1970"
    ),
    "a file in another unit": beside(
        {}, {"shift": 0.0}, TRIGGER, "'F [kN]', the machine file N (a factor of 1000)", "F [kN]"
    ),
}


@pytest.mark.parametrize(("written", "cell", "align", "said", "name"), ABSENT.values(), ids=ABSENT)
def test_a_file_that_cannot_be_aligned_is_a_loss_with_the_reason(tmp_path, written, cell, align, said, name):
    write_log(tmp_path, **written)
    write_cell(tmp_path, **cell)
    path = tmp_path / "cell_03.csv"
    path.write_text(path.read_text(encoding="utf-8").replace("F", name, 1), encoding="utf-8")
    recording = read(tmp_path, align)
    (lost,) = [item for item in recording.findings if item.kind == "absent_file"]
    assert "force" not in recording and lost.severity == "loss"
    assert said in lost.numbers["reason"] and "cell_03.csv" in str(lost)


@pytest.mark.parametrize(
    "content", ["", "x\n", "time,F\n1,2\n3,4\n", "time,other,trig\n1,2,0\n2,3,1\n", "\x00\x01\x02"]
)
def test_a_damaged_file_leaves_the_log_without_a_cell(tmp_path, content):
    write_log(tmp_path)
    (tmp_path / "cell_03.csv").write_text(content, encoding="utf-8")
    recording = read(tmp_path, TRIGGER)
    assert "force" not in recording and "speed" in recording
    assert len(facts(recording, "absent_file")) == 1


def test_the_log_itself_is_not_its_load_cell(tmp_path):
    write_log(tmp_path)
    recording = read(tmp_path, "time_offset = 0.0", cell=CELL.replace("cell_{stem}.csv", "{name}"))
    assert "it is the log itself" in facts(recording, "absent_file")[0].numbers["reason"]


def test_the_onset_may_be_earlier_by_what_is_not_known_of_the_clocks(tmp_path):
    time = np.arange(0.0, 4.0, 1e-3)
    force = Series(time, np.where((time > 1.0) & (time < 1.2), 100.0, 0.0), "N")
    known = Recording("r", "r", ("axis",), {"force": force})
    (exact,), (wide,) = (
        find_contacts(item, OnsetRule(above=20.0)) for item in (known, replace(known, truth_clock=0.01))
    )
    assert wide.uncertainty == pytest.approx(exact.uncertainty + 0.01) and wide.start == exact.start


@pytest.mark.parametrize(
    ("cell", "align", "said"),
    [
        (CELL, "scale = 1.0", "the clocks are not aligned"),
        (CELL, f'{TRIGGER}, clock = "epoch"', "the clocks are not aligned"),
        (CELL, 'clock = "log"', "clock: is 'log'"),
        (CELL, 'trigger = { log = "sync" }', "trigger.file: is missing"),
        (CELL.replace("{stem}", "03"), TRIGGER, "name the log in it"),
        (CELL.replace("{stem}", "{stam}"), TRIGGER, r"has \{stam\}"),
        (CELL.replace("cell_", "\\u0000"), TRIGGER, "name the log in it"),
        (CELL.replace(', time = { column = "time", unit = "ms" }', ""), TRIGGER, "force.time: is missing"),
        (CELL.replace("force", "x"), 'topic = "/cell", time_offset = 0', "unknown key"),
    ],
)
def test_a_wrong_entry_is_refused_by_its_key(tmp_path, cell, align, said):
    with pytest.raises(ConfigurationError, match=said) as fault:
        machine(tmp_path, align, cell)
    assert "channels.force" in str(fault.value)


def test_a_cell_beside_a_log_of_topics_is_aligned_by_a_topic(tmp_path):
    time = jittered(0.0, 4.0, 200.0, 1)
    speed = Stream("/joints", "sensor_msgs/msg/JointState", time, {"velocity": np.ones((len(time), 1))}, ("axis",))
    high = ((time >= 1.0) & (time < 1.05)).astype(float)
    sync = Stream("/sync", "geometry_msgs/msg/WrenchStamped", time, {"wrench.force.x": high})
    write_mcap(tmp_path / "03.mcap", [speed, sync])
    write_cell(tmp_path, 7.0)
    section = '[channels.mcap]\nspeed = { topic = "/joints", field = "velocity[0]" }\n'
    align = TRIGGER.replace("sync", "/sync wrench.force.x")
    recording = read_as_logged(tmp_path / "03.mcap", machine(tmp_path, align, section=section)).recording
    force = recording["force"]
    assert np.abs(force.values[:, 0] / 100.0 - force.time).max() < 0.0075
    with pytest.raises(ConfigurationError, match="give topic and field"):
        machine(tmp_path, TRIGGER, section=section)
