"""Tables with a clock for each channel: no channel is read with the clock of another."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import cdtool
from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding
from cdtool.commands.convert.converting import convert
from cdtool.formats.channels.reading import read_recording
from cdtool.formats.csv import Csv
from cdtool.formats.pieces import join_pieces
from tests.base.findings.facts import fact_of

OWN = """[channels]
time = { column = "time", unit = "s" }
torque = { column = "torque", unit = "N m" }
force = { column = "force", unit = "N" }
speed = { column = "speed", unit = "rad/s" }
"""
HEADERS = [
    "time1,force,time2,torque,speed",
    "time,force,time,torque,speed",
    "time,force,time2,torque,speed",
    "X_Value,force,X_Value,torque,speed",
]


def named(clock: str) -> str:
    return OWN.replace('"time", unit', f'"{clock}", unit')


def table(header: str, first, second, mark: str = ",") -> str:
    """Return a table with two clocks, the shorter one padded with empty cells.

    Force is the number of the row, torque 10 times and speed 100 times the number.
    """
    lines = [header.replace(",", mark)]
    for i in range(max(len(first), len(second))):
        a = f"{first[i]:.9f},{i}" if i < len(first) else ","
        b = f"{second[i]:.9f},{10 * i},{100 * i}" if i < len(second) else ",,"
        lines.append(f"{a},{b}".replace(",", mark))
    return "\n".join(lines) + "\n"


CELL, DRIVE = np.arange(50) / 2000.0, np.arange(40) / 1000.0


def clock_warnings(source) -> list[Finding]:
    return [finding for finding in source.findings if finding.kind == "other_clock"]


@pytest.mark.parametrize("header", HEADERS)
def test_each_channel_has_the_clock_before_it(log, machine, header):
    recording = read_recording(log(table(header, CELL, DRIVE)), machine(OWN))
    assert recording["force"].time.tolist() == CELL.tolist()
    assert recording["force"].values[:, 0].tolist() == list(range(50))
    for channel in ("torque", "speed"):
        assert recording[channel].time.tolist() == DRIVE.tolist()
    assert not [finding for finding in recording.findings if finding.severity != "note"]
    assert [finding.kind for finding in recording.findings if finding.channel == "time"] == ["own_clocks"]


def test_clocks_in_ms_without_a_unit_are_refused_rather_than_read_in_s(log, machine):
    path = log(table("time,force,time2,torque,speed", 1e3 * CELL, 1e3 * DRIVE))
    with pytest.raises(RecordingError, match="is beside the clock 'time2'") as fault:
        read_recording(path, machine(OWN.replace('unit = "s"', 'unit = "ms"')))
    assert "in the unit of its header ('time2 [ms]')" in fault.value.hint
    path = log(table("time [ms],force,time2 [ms],torque,speed", 1e3 * CELL, 1e3 * DRIVE))
    recording = read_recording(path, machine(OWN))
    assert recording["force"].time == pytest.approx(CELL) and recording["torque"].time == pytest.approx(DRIVE)


@pytest.mark.parametrize(
    ("start", "step", "why"),
    [
        (0.0, 0.001, r"their steps are 0\.001 and 0\.0005"),
        (0.0, 0.00051, r"their steps are 0\.00051 and 0\.0005"),
        (0.0, 0.0005002, r"they drift apart by 0\.0008"),
        (0.0071, 0.0005, r"it starts at 0\.0071, not 0"),
    ],
    ids=["other rate", "2 % slower", "drifting", "later"],
)
@pytest.mark.parametrize("clock", ["time1", "time2"])
def test_one_clock_for_all_channels_is_refused_if_the_times_differ(log, machine, start, step, why, clock):
    count = np.arange(4000)
    path = log(table(HEADERS[0], 0.0005 * count, start + step * count))
    wrong, other = ("torque", "time2") if clock == "time1" else ("force", "time1")
    text = rf"column '{wrong}' is beside the clock '{other}', but the machine file names '{clock}': "
    if clock == "time1":
        text += why
    with pytest.raises(RecordingError, match=text) as fault:
        read_recording(path, machine(named(clock)))
    assert 'time = { column = "time", unit = "s" }' in fault.value.hint
    only = "\n".join(line for line in named(clock).splitlines() if wrong not in line and "speed" not in line)
    remaining = "force" if clock == "time1" else "torque"
    assert len(read_recording(path, machine(only))[remaining]) == 4000
    for source in (Csv().columns(path), join_pieces(Csv().pieces(path), sort=False)):
        if why.startswith("their steps"):
            assert not clock_warnings(source) and source.columns["torque"].time[-1] == pytest.approx(
                start + step * 3999
            )
            continue
        (warning,) = clock_warnings(source)
        assert warning.channel == "time2" and warning.kind == "other_clock"
        assert (warning.numbers["first"], warning.numbers["columns"]) == ("time1", ("torque", "speed"))


@pytest.mark.parametrize(
    ("header", "second"),
    [
        ("time1,force,time2,torque,speed", CELL),
        ("time1,force,time_ms,torque,speed", 1e3 * CELL),
        ("time1,force,timestamp,torque,speed", 1.7e9 + CELL),
        ("time1,force,timestamp [us],torque,speed", 1e6 * CELL),
        ("time1,force,t_motor,torque,speed", 20.0 + 5.0 * np.sin(300.0 * CELL)),
    ],
    ids=["same", "in ms", "since 1970", "in us", "a temperature"],
)
def test_a_second_clock_with_the_same_times_is_not_reported(log, machine, header, second):
    path = log(table(header, CELL, second))
    recording = read_recording(path, machine(named("time1")))
    assert recording["torque"].time.tolist() == CELL.tolist()
    assert not clock_warnings(Csv().columns(path))


def test_clocks_after_their_channels_are_recognised_by_the_last_column(log, machine):
    rows = "".join(f"{i},{i / 2000},{10 * i},{100 * i},{i / 1000}\n" for i in range(50))
    recording = read_recording(log("force,time1,torque,speed,time2\n" + rows), machine(OWN))
    assert recording["force"].time[-1] == 49 / 2000 and recording["torque"].time[-1] == 49 / 1000


def test_a_channel_without_a_clock_is_refused(log, machine):
    rows = "".join(f"{i},{i / 2000},{10 * i},{i / 1000},{100 * i}\n" for i in range(50))
    with pytest.raises(RecordingError, match="no clock is beside column 'force'"):
        read_recording(log("force,time1,torque,time2,speed\n" + rows), machine(OWN))


def test_values_without_a_time_are_a_loss(log, machine):
    rows = "".join(f"{i / 2000},{i},{'' if i == 7 else i / 1000},{10 * i},{100 * i}\n" for i in range(50))
    recording = read_recording(log(HEADERS[0] + "\n" + rows), machine(OWN))
    assert len(recording["torque"]) == 49 and len(recording["force"]) == 50
    lost = [finding for finding in recording.findings if finding.severity == "loss"]
    assert lost == [Finding("values_without_time", channel, {"count": 1}) for channel in ("torque", "speed")]


@pytest.mark.parametrize("unit", ["", " [ms]"])
def test_without_a_machine_file_channels_of_other_rates_have_the_clocks_beside_them(log, tmp_path, unit):
    factor = 1e3 if unit else 1.0
    text = table(f"t1{unit};torque [N m];t2{unit};position [mm];speed [mm/s]", factor * CELL, factor * DRIVE, ";")
    path = log(text.replace(",", ";"))
    for source in (Csv().columns(path), join_pieces(Csv().pieces(path), sort=False)):
        assert list(source.columns) == ["torque [N m]", "position [mm]", "speed [mm/s]"]
        assert source.columns["torque [N m]"].time == pytest.approx(CELL)
        assert source.columns["speed [mm/s]"].time == pytest.approx(DRIVE)
        assert source.columns["position [mm]"].values.tolist() == [10.0 * i for i in range(40)]
        facts = [fact_of(finding) for finding in source.findings]
        assumed = [] if unit else [("clock_unit_assumed", {"clocks": ("t1", "t2"), "step": pytest.approx(0.0005)})]
        assert facts == [("own_clocks", {"clocks": (f"t1{unit}", f"t2{unit}")}), *assumed]
    info = cdtool.info(path)
    assert [(item.samples, item.missing) for item in info.channels] == [(50, 0), (40, 0), (40, 0)]
    assert [item.rate_hz for item in info.channels] == pytest.approx([2000.0, 1000.0, 1000.0])
    draft = cdtool.init(path, tmp_path / "draft.toml").text
    assert 'time = { column = "time", unit = "s" }' in draft
    clock = next(line for line in draft.splitlines() if line.startswith("time ="))
    words = " ".join(draft.replace("#", " ").split())
    assert ("read in s, at 2000 Hz" in words) is not bool(unit) and clock
    converted = convert(path, tmp_path / "log.mcap").files[0]
    assert {item.samples for item in cdtool.info(converted).channels} == {50, 40}


def test_a_second_clock_without_channels_of_its_own_is_reported_and_changes_nothing(log):
    """As in a table of a UR robot: a count of seconds and words, then a time stamp beside all channels."""
    rows = "".join(f"{i},w{i},{i / 25},{i},{10 * i},{100 * i}\n" for i in range(200))
    path = log("time,word,timestamp,force,torque,speed\n" + rows)
    for source in (Csv().columns(path), join_pieces(Csv().pieces(path), sort=False)):
        assert [item.channel for item in clock_warnings(source)] == ["timestamp"]
        assert all(column.time is None for column in source.columns.values())


def test_a_long_table_is_read_in_pieces_with_the_times_of_the_whole(log, monkeypatch):
    monkeypatch.setattr("cdtool.formats.csv.text.BLOCK_BYTES", 1 << 18)
    first, second = 1.7e9 + np.arange(60_000) / 2000.0, 1.7e9 + 0.25 + np.arange(20_000) / 500.0
    path = log(table("time1 [s],force,time2 [s],torque,speed", first, second))
    pieces = list(Csv().pieces(path))
    whole, joined = Csv().columns(path), join_pieces(Csv().pieces(path), sort=False)
    assert len(pieces) > 4 and path.stat().st_size > 1 << 21
    assert whole.origin == joined.origin == 1.7e9
    for name, column in whole.columns.items():
        assert np.array_equal(column.values, joined.columns[name].values)
        assert np.array_equal(column.time, joined.columns[name].time)
    assert joined.columns["speed"].time[0] == 0.25


@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(
    rates=st.lists(st.sampled_from([50, 100, 250, 1000]), min_size=2, max_size=2, unique=True),
    counts=st.lists(st.integers(8, 60), min_size=2, max_size=2),
    mark=st.sampled_from([",", "\t", ";"]),
)
def test_no_channel_is_read_with_the_clock_of_another(log, machine, rates, counts, mark):
    first, second = (np.arange(count) / rate for count, rate in zip(counts, rates, strict=True))
    path = log(table(HEADERS[0], first, second, mark))
    recording = read_recording(path, machine(OWN))
    assert recording["force"].time.tolist() == first.tolist()
    assert recording["torque"].time.tolist() == second.tolist()
    with pytest.raises(RecordingError, match="is beside the clock"):
        read_recording(path, machine(named("time1")))
