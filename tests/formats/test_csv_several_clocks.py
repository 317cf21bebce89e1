"""Tables with a clock for each channel: no channel is read with the clock of another."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding
from cdtool.formats.channels.reading import read_recording
from cdtool.formats.csv import Csv
from cdtool.formats.pieces import join_pieces

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
def test_channels_beside_clocks_of_other_rates_are_refused_and_reported(log, machine, header):
    path = log(table(header, CELL, DRIVE))
    first, second = (name for name in Csv().columns(path).names if name[:1] in "tX" and name != "torque")
    for clock in (f'"{first}"', "0"):
        with pytest.raises(RecordingError, match=f"column 'torque' is beside the clock '{second}'") as fault:
            read_recording(path, machine(OWN.replace('"time", unit', f"{clock}, unit")))
        assert "it has 40 stamps, not 50" in str(fault.value)
        assert fault.value.hint == "split the table into a file for each clock"
    for source in (Csv().columns(path), join_pieces(Csv().pieces(path), sort=False)):
        (warning,) = clock_warnings(source)
        assert warning.channel == second and warning.numbers["columns"] == ("torque", "speed")
        assert all(column.time is None for column in source.columns.values())


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
    assert fault.value.hint == "split the table into a file for each clock"
    only = "\n".join(line for line in named(clock).splitlines() if wrong not in line and "speed" not in line)
    remaining = "force" if clock == "time1" else "torque"
    assert len(read_recording(path, machine(only))[remaining]) == 4000
    for source in (Csv().columns(path), join_pieces(Csv().pieces(path), sort=False)):
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


def test_adjacent_clocks_belong_to_the_same_rows(log, machine):
    rows = "".join(f"{i / 100},{i / 100 + (i % 7) * 0.002},{i},{10 * i},{100 * i}\n" for i in range(60))
    path = log("time,stamp_s,force,torque,speed\n".replace("stamp_s", "timestamp") + rows)
    assert read_recording(path, machine(named("time")))["torque"].time[-1] == 0.59
    assert not clock_warnings(Csv().columns(path))


def test_clocks_after_their_channels_are_recognised_by_the_last_column(log):
    rows = "".join(f"{i},{i / 2000},{10 * i},{100 * i},{i / 1000}\n" for i in range(50))
    (warning,) = clock_warnings(Csv().columns(log("force,time1,torque,speed,time2\n" + rows)))
    assert (warning.channel, warning.numbers["columns"]) == ("time2", ("torque", "speed"))


def test_a_second_clock_without_channels_of_its_own_is_reported_and_changes_nothing(log):
    """As in a table of a UR robot: a count of seconds and words, then a time stamp beside all channels."""
    rows = "".join(f"{i},w{i},{i / 25},{i},{10 * i},{100 * i}\n" for i in range(200))
    path = log("time,word,timestamp,force,torque,speed\n" + rows)
    for source in (Csv().columns(path), join_pieces(Csv().pieces(path), sort=False)):
        assert [item.channel for item in clock_warnings(source)] == ["timestamp"]
        assert all(column.time is None for column in source.columns.values())


@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(
    rates=st.lists(st.sampled_from([50, 100, 250, 1000]), min_size=2, max_size=2, unique=True),
    counts=st.lists(st.integers(8, 60), min_size=2, max_size=2),
    mark=st.sampled_from([",", "\t", ";"]),
)
def test_no_channel_is_read_with_the_clock_of_another(log, machine, rates, counts, mark):
    first, second = (np.arange(count) / rate for count, rate in zip(counts, rates, strict=True))
    path = log(table(HEADERS[0], first, second, mark))
    with pytest.raises(RecordingError, match="no column 'time'"):
        read_recording(path, machine(OWN))
    with pytest.raises(RecordingError, match="is beside the clock"):
        read_recording(path, machine(named("time1")))
