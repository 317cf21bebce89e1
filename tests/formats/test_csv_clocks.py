"""Clocks of tables that can be read in two ways, or that start again: no time is silently wrong."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.base.errors import RecordingError
from cdtool.formats.channels.reading import read_recording
from cdtool.formats.csv import Csv
from cdtool.formats.pieces import join_pieces
from tests.base.findings.facts import fact_of
from tests.formats.conftest import COLUMNS

SECONDS = COLUMNS.replace('"ms"', '"s"')
START = 45231 + 13 / 24  # 2023-11-01 13:00


def facts(source) -> list[tuple]:
    return [fact_of(finding) for finding in source.findings]


def table(stamps) -> str:
    return "t,i_motor,n_motor\n" + "".join(f"{stamp},1,{i}\n" for i, stamp in enumerate(stamps))


@pytest.mark.parametrize("decimals", [12, 8, 5, 4])
@pytest.mark.parametrize("period", [0.001, 0.1, 1.0, 4.0])
def test_days_of_excel_are_refused_with_both_readings_whatever_their_rate_and_decimals(log, machine, decimals, period):
    stamps = [f"{START + i * period / 86400:.{decimals}f}" for i in range(40_000)]
    path = log(table(stamps))
    with pytest.raises(RecordingError, match=r"starts at 45231\.541\d* in .*days of Excel \(2023-11-01 ") as one:
        read_recording(path, machine(SECONDS))
    assert "or 45231.541" in one.value.message and 'time_format = "excel" or "number"' in one.value.hint


def test_days_of_excel_are_read_by_either_pin(log, machine):
    path = log(table(f"{START + i / 86400:.9f}" for i in range(50)))
    with pytest.raises(RecordingError, match=r"\(2023-11-01 13:00:00, 1 Hz\), or 45231\.5\d* s at 86"):
        read_recording(path, machine(SECONDS))
    days = read_recording(path, machine(SECONDS + '[csv]\ntime_format = "excel"\n'))
    assert days["speed"].time == pytest.approx(np.arange(50.0), abs=1e-4)
    assert np.datetime64(round(days.origin), "s") == np.datetime64("2023-11-01T13:00:00")
    plain = read_recording(path, machine(SECONDS + '[csv]\ntime_format = "number"\n'))
    assert plain["speed"].time == pytest.approx(START + np.arange(50) / 86400, abs=1e-8)


@pytest.mark.parametrize(
    ("first", "step", "unit"),
    [(45231.5, 1e-3, "s"), (45231.5, 1e-4, "s"), (45231.5, 0.1, "ms"), (45231.5, 1, "us"), (0.0, 1e-5, "s")],
    ids=["1 kHz", "10 kHz", "10 kHz in ms", "1 MHz in us", "100 kHz from 0"],
)
def test_a_clock_in_seconds_in_the_range_of_days_of_excel_is_read(log, machine, first, step, unit):
    path = log(table(f"{first + i * step:.6f}" for i in range(50)))
    factor = {"s": 1.0, "ms": 1e-3, "us": 1e-6}[unit]
    recording = read_recording(path, machine(COLUMNS.replace('"ms"', f'"{unit}"')))
    assert recording["speed"].time == pytest.approx((first + step * np.arange(50)) * factor, rel=1e-9)


def minutes(seconds: float) -> str:
    return f"{int(seconds // 60) % 60:02d}:{seconds % 60:06.3f}"


@pytest.mark.parametrize("pin", ["", '[csv]\ntime_format = "%M:%S.%f"\n'], ids=["detected", "pinned"])
def test_minutes_and_seconds_continue_after_the_full_hour(log, machine, pin):
    times = 3590.0 + 0.5 * np.arange(15_000)  # two hours and five minutes, with three full hours
    recording = read_recording(log(table(map(minutes, times))), machine(SECONDS + pin))
    assert recording["speed"].time.tolist() == times.tolist()
    assert (
        "written_times",
        {"pattern": "%M:%S.%f", "since": "the full hour", "days_column": "", "wraps": "the full hour", "wrapped": 3},
    ) in facts(recording)
    assert not [finding for finding in recording.findings if finding.channel == "time"]


def test_a_full_hour_between_two_blocks_is_detected(log, monkeypatch):
    monkeypatch.setattr("cdtool.formats.csv.text.BLOCK_BYTES", 1 << 9)
    times = 3590.0 + 0.5 * np.arange(400)
    source = join_pieces(Csv().pieces(log(table(map(minutes, times)))), sort=False)
    assert source.columns["t"].values.tolist() == times.tolist()


def test_a_single_backward_step_is_reported_and_not_a_full_hour(log, machine):
    times = [*np.arange(1800.0, 1810.0), 1801.5, *np.arange(1810.0, 1820.0)]
    recording = read_recording(log(table(map(minutes, times))), machine(SECONDS))
    assert recording["speed"].time.tolist() == [*np.arange(1800.0, 1820.0)]
    assert ("backward_stamps", {"count": 1, "rows": 21, "first": (12,), "row_name": "line", "restart": None}) in facts(
        recording
    )


def test_half_days_without_am_and_pm_continue_after_noon(log, machine):
    seconds = 43190 + np.arange(20)
    stamps = [f"{(s // 3600 - 1) % 12 + 1:02d}:{s // 60 % 60:02d}:{s % 60:02d}" for s in seconds.tolist()]
    pinned = machine(SECONDS + '[csv]\ntime_format = "%I:%M:%S"\n')
    time = read_recording(log(table(stamps)), pinned)["speed"].time
    assert np.diff(time).tolist() == [1.0] * 19
