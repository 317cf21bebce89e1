"""Integers with more digits than float64: clocks are exact to the nanosecond, other rounded numbers are counted."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cdtool.base.findings import Finding
from cdtool.formats.channels.reading import read_recording
from cdtool.formats.large_integers import rounded_integers
from tests.formats.conftest import COLUMNS

EPOCH = 1_700_000_000_123_456_789


def rounding_findings(source) -> list[Finding]:
    return [finding for finding in source.findings if finding.kind == "rounded_integers"]


def stamp_text(ns: int, unit: str, mark: str = ".") -> str:
    """Return a time stamp in a unit, with all its digits."""
    decimals = {"s": 9, "ms": 6, "us": 3, "ns": 0}[unit]
    return str(ns) if not decimals else f"{ns // 10**decimals}{mark}{ns % 10**decimals:0{decimals}d}"


def same(time: np.ndarray, nanoseconds) -> bool:
    """Return True if the times equal the nanoseconds, except for the rounding of the unit factor."""
    return len(time) == len(nanoseconds) and np.allclose(time, np.array(nanoseconds) / 1e9, rtol=4e-16, atol=0.0)


def clock_in(unit: str) -> str:
    return COLUMNS.replace('"ms"', f'"{unit}"')


@pytest.mark.parametrize("unit", ["s", "ms", "us", "ns"])
@pytest.mark.parametrize("separator", [",", ";", "\t", " "], ids=["comma", "semicolon", "tab", "blank"])
@pytest.mark.parametrize("at", [0, 2], ids=["first", "last"])
def test_stamps_since_1970_keep_every_nanosecond(log, machine, unit, separator, at):
    stamps = EPOCH + np.cumsum(np.random.default_rng(3).integers(900_001, 1_100_003, 500))
    names, rows = ["i_motor", "n_motor"], []
    names.insert(at, "t")
    for i, stamp in enumerate(stamps.tolist()):
        row = ["1.5", f"{i}.25"]
        row.insert(at, stamp_text(stamp, unit, "," if separator == ";" else "."))
        rows.append([cell.replace(".", ",") if separator == ";" else cell for cell in row])
    text = "\n".join(separator.join(row) for row in [names, *rows]) + "\n"
    recording = read_recording(log(text), machine(clock_in(unit)))
    assert same(recording["speed"].time, stamps - stamps[0])
    assert recording.origin == stamps[0] / 1e9
    assert not rounding_findings(recording)


def test_lines_that_are_not_rows_do_not_shift_the_stamps(log, machine, monkeypatch):
    monkeypatch.setattr("cdtool.formats.csv.text.BLOCK_BYTES", 256)
    stamps = [EPOCH + 1_000_001 * i for i in range(200)]
    lines = [f"{stamp},1,{i}" for i, stamp in enumerate(stamps)]
    lines[150:150] = ["# a comment", "", "t,i_motor,n_motor"]
    lines[60:60] = ["", "", "# another one"]
    lines[20] = '"' + lines[20].replace(",", '","') + '"'
    text = "t,i_motor,n_motor\n# units unknown\n" + "\n".join(lines) + "\n"
    time = read_recording(log(text), machine(clock_in("ns")))["speed"].time
    differences = np.array(stamps) - EPOCH
    assert time[20] == pytest.approx(differences[20] / 1e9, abs=2e-7)  # in quotes: read as float64
    assert same(np.delete(time, 20), np.delete(differences, 20))


@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(
    first=st.integers(10**17, 9 * 10**18),
    steps=st.lists(st.integers(1, 10**10), min_size=4, max_size=40),
    unit=st.sampled_from(["s", "ms", "us", "ns"]),
    last=st.booleans(),
)
def test_any_stamps_are_exact_to_the_nanosecond(log, machine, first, steps, unit, last):
    stamps = [first + sum(steps[:i]) for i in range(len(steps) + 1)]
    rows = "".join(f"{i}.5,{stamp_text(x, unit)},1\n" for i, x in enumerate(stamps))
    path = log("n_motor,t,i_motor\n" + (rows if last else rows[:-1]))
    time = read_recording(path, machine(clock_in(unit)))["speed"].time
    assert same(time, [stamp - first for stamp in stamps[: len(time)]])
    assert len(time) >= len(stamps) - (not last)


@pytest.mark.parametrize(
    ("values", "count"),
    [
        ([0.0, 2.0**53, -(2.0**53)], 0),
        ([2.0**53 + 2, -(2.0**53) - 2, 2.0**64], 3),
        ([1e20, -1e300, np.inf, np.nan], 0),
        ([], 0),
    ],
    ids=["exact", "rounded", "no 64 bits", "empty"],
)
def test_64_bit_integers_that_float64_rounds_are_counted(values, count):
    assert rounded_integers(np.array(values)) == count
