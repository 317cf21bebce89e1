"""Tables that can be read in two ways are refused with both readings, and each reading can be pinned."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdtool.base.errors import RecordingError
from cdtool.formats.channels.channel_map import ChannelMap, ChannelSource, TablePins, TimeSource
from cdtool.formats.csv import Csv
from tests.time_bounds import bounded

BEYOND = 19_000  # rows, more than the sample has


def rows(values, separator=";", first=0) -> str:
    return "".join(f"{first + i}{separator}{value}\n" for i, value in enumerate(values))


def pinned(path, **pins) -> np.ndarray:
    """Return the last column, read with these pins and a rate."""
    wanted = ChannelMap(TimeSource(rate=1.0), (ChannelSource("torque", (pins.pop("column", 1),)),), ("a",))
    source = Csv().columns(path, replace(wanted, pins=TablePins(**pins)))
    return next(iter(source.columns.values())).values


THOUSANDS = ["997", "998", "999", "1.000", "1.001"]


@pytest.mark.parametrize("separator", ["\t", ";", "|", " ", ","], ids=["tab", "semicolon", "pipe", "blank", "comma"])
def test_whole_numbers_with_points_before_three_digits_are_refused_and_can_be_pinned(log, separator):
    path = log(f"t{separator}pos\n" + rows(THOUSANDS, separator))
    with pytest.raises(RecordingError, match=r"line 5, column 'pos': '1\.000' may be 1000 .* or 1\.000 "):
        Csv().columns(path)
    assert pinned(path, decimal=".").tolist() == [997, 998, 999, 1.0, 1.001]
    if separator != ",":
        for pin in ({"decimal": ","}, {"thousands": "."}):
            assert pinned(path, **pin).tolist() == [997, 998, 999, 1000, 1001]


def test_an_ambiguous_point_after_the_sample_is_also_refused(log):
    table = "t;pos\n" + rows([900] * BEYOND) + rows(["1.000", "1.001"], first=BEYOND)
    with pytest.raises(RecordingError, match=rf"line {BEYOND + 2}, column 'pos': '1\.000' may be 1000"):
        Csv().columns(log(table))


@pytest.mark.parametrize(
    ("cell", "value"), [("1,5", 1.5), ("1.25", 1.25), ("0.125", 0.125), ("1'234", 1234.0), ("1.234.567", 1234567.0)]
)
@pytest.mark.parametrize("stamp", ["", "12:00:00.125;", "03.04.2025;"], ids=["plain", "times", "dates"])
def test_the_first_number_with_a_mark_after_the_sample_decides(log, cell, value, stamp):
    table = (
        ("s;" if stamp else "") + "t;x\n" + "".join(f"{stamp}{i};900\n" for i in range(BEYOND)) + f"{stamp}1;{cell}\n"
    )
    assert Csv().columns(log(table)).columns["x"].values[-1] == value


@pytest.mark.parametrize(
    "head",
    ["", "# force\n", "force\n", "force\nN\n", "rig 4\nforce\n"],
    ids=["no header", "comment", "name", "name and unit", "preamble"],
)
@pytest.mark.parametrize(
    "cells",
    [
        ["-3,0691e+00", "1,0412e-01", "2,0001e+00"],
        ["100.000,0", "99.500,5", "1.000,5"],
        ["-154,865.221", "57,490.161", "20,425.262"],
        ["28\u00a0606,6", "64\u00a0556,7", "90\u00a0037,5"],
        ["3'438,281", "19'778,858", "54'394,945"],
        ["100000,0", "100010,0", "100020,0"],
        ["1,5", "-2,25", "7,0"],
    ],
    ids=["exponents", "groups", "thousands by commas", "blanks", "apostrophes", "one digit", "plain"],
)
def test_one_column_of_numbers_with_commas_is_never_read_as_two(log, head, cells):
    with pytest.raises(RecordingError, match=r"one number .* or two cells"):
        Csv().columns(log(head + "\n".join(cells) + "\n"))


@pytest.mark.parametrize("above", ["990.000\n997.700", "997.700", "-1", "nan"])
def test_a_number_above_rows_of_two_cells_is_a_row_of_the_same_column(log, above):
    with pytest.raises(RecordingError, match=r"line [34]: '1,005\.400' may be one number .* or two cells"):
        Csv().columns(log(f"F0\n{above}\n1,005.400\n1,013.100\n1,020.800\n"))


@pytest.mark.parametrize("cells", [["1,2", "3,4", "5,6"], ["10,1,2", "20,3,4"], ["1.250,5,7", "1.500,6,8"]])
def test_commas_between_whole_numbers_without_names_need_a_pin(log, cells):
    path = log("\n".join(cells) + "\n")
    with pytest.raises(RecordingError, match=r"line 1: .* may be one number \(decimal comma\) or two cells"):
        Csv().columns(path)
    assert pinned(path, separator=",", decimal=".").tolist() == [float(cell.split(",")[1]) for cell in cells]


@pytest.mark.parametrize("mark", [":", "."])
def test_milliseconds_without_zeros_are_refused_where_they_would_run_backward(log, mark):
    stamps = [f"12:00:00{mark}{ms}" for ms in (8, 9, 10, 99, 100)]
    with pytest.raises(RecordingError, match=rf"column 't': '10' after '12:00:00{mark}9' may be 0\.10 s or 10 ms"):
        Csv().columns(log("t;x\n" + "".join(f"{stamp};1\n" for stamp in stamps)))


def test_two_pairs_of_digits_are_refused_unless_a_cell_shows_whether_they_are_minutes(log, machine):
    path = log("t;x\n" + "".join(f"00:0{i};1\n" for i in range(5)))
    with pytest.raises(
        RecordingError, match=r"'00:01' may be 00:01:00 \(%H:%M\) or 00:00:01 \(%M:%S\.%f\) .*time_format"
    ):
        Csv().columns(path)
    channels = '[channels]\ntime = { column = "t", unit = "s" }\nspeed = { column = "x", unit = "rad/s" }\n[csv]\n'
    for pattern, step in (("%H:%M", 60), ("%M:%S", 1)):
        wanted = machine(channels + f'time_format = "{pattern}"\n').columns
        assert Csv().columns(path, wanted).columns["t"].values.tolist() == [step * i for i in range(5)]
    minutes = Csv().columns(log("t;x\n" + "".join(f"23:5{i};1\n24:0{i};1\n" for i in range(3))))
    assert minutes.columns["t"].values.tolist()[:2] == [23 * 60 + 50, 24 * 60]
    with_days = Csv().columns(log("d;t;x\n" + "".join(f"2025-04-03;12:0{i};1\n" for i in range(3))))
    assert with_days.columns["t"].values.tolist() == [60 * i for i in range(3)]


@pytest.mark.parametrize(
    "line",
    ["-" * 200_000 + "x", "[" + " " * 20_000 + "x", "=" * 99_999 + "|x", "-" * 50_000 + "x" + "-" * 50_000],
    ids=["dashes", "bracket", "double dashes", "dashes around a letter"],
)
def test_a_long_line_of_one_letter_is_read_or_refused_with_its_number(log, line):
    path = log(f"t;x\n0;1.5\n{line}\n1;2.5\n" if line[0] != "[" else f"t;{line};x\n{line};;[N]\n0;0;1\n1;0;2\n")
    with bounded(3.0):
        try:
            Csv().columns(path)
        except RecordingError as fault:
            assert "line 3" in fault.message
