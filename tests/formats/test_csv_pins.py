"""`[csv]` of the machine file: its pins replace detected properties, and are checked against the file."""

from __future__ import annotations

import tomllib

import numpy as np
import pytest

import cdtool
from cdtool.base.errors import ConfigurationError, RecordingError
from cdtool.base.settings import Place
from cdtool.formats.channels.channel_map import ChannelMap, ChannelSource, TimeSource
from cdtool.formats.channels.reading import read_recording
from cdtool.formats.csv import Csv
from cdtool.formats.csv_dialect.pins import read_pins
from tests.formats.conftest import COLUMNS
from tests.formats.csv_cases import cases

READABLE = [case for case in cases(4) if case.columns is not None and not case.pins]

ROWS = "t;i_motor;n_motor\n" + "".join(f"{10 * i};{i % 7 + 1},{i % 9}25;{i}\n" for i in range(20))


def pinned(text: str) -> str:
    return COLUMNS + "[csv]\n" + text + "\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("separators = 3", "csv.separators: unknown key.*did you mean separator"),
        ('separator = "x"', "csv.separator: is 'x'.*comma"),
        ('decimal = ";"', "csv.decimal: is ';'"),
        ('thousands = "_"', "csv.thousands: is '_'"),
        ('decimal = ","\nthousands = ","', "csv.thousands: is ',', the same as decimal"),
        ('encoding = "klingon"', "csv.encoding: is 'klingon'.*utf-8"),
        ('encoding = "cp037"', "csv.encoding: is 'cp037'"),
        ("header = true", "csv.header: is true.*number of its line"),
        ("header = 0", "csv.header: is 0"),
        ("header = false\nunits = 2", "csv.units: is 2, but header is false"),
        ("skip_lines = -1", "csv.skip_lines: is -1"),
        ('missing = "ok"\ncomment = 3', "csv.comment: is 3"),
        ('time_format = "%Q"', "csv.time_format: is '%Q'.*not supported"),
        ('time_format = "%Y-%m"', "csv.time_format: .*%d is missing"),
        ('time_format = "days"', "csv.time_format: is 'days'"),
    ],
)
def test_a_wrong_pin_is_one_line_that_names_the_key(machine, text, words):
    with pytest.raises(ConfigurationError, match=words) as fault:
        machine(pinned(text))
    assert "\n" not in str(fault.value)


def test_a_pinned_mark_decides_if_the_file_is_ambiguous(log, machine):
    path = log(ROWS)
    with pytest.raises(RecordingError, match=r"'1,025' may be 1\.025 \(decimal comma\) or 1025 \(thousands\)"):
        Csv().columns(path, machine().columns)
    decimal = Csv().columns(path, machine(pinned('decimal = ","')).columns)
    thousands = Csv().columns(path, machine(pinned('decimal = "."\nthousands = ","')).columns)
    assert decimal.columns["i_motor"].values[3] == 4.325
    assert thousands.columns["i_motor"].values[3] == 4325.0


def test_the_dialect_that_info_prints_can_be_pasted_and_reads_the_same(log, machine):
    path = log("rig 4\n\nt;i_motor;n_motor\nms;A;rad/s\n" + ROWS.partition("\n")[2].replace("25;", "5;"))
    found = cdtool.info(path)
    assert "header" not in tomllib.loads(found.dialect)["csv"] and "# header = 3  (in this file" in found.dialect
    again = cdtool.info(path, machine=machine(COLUMNS + found.dialect + "\n"))
    assert again.dialect == found.dialect
    assert again.channels[0].samples == 20


@pytest.mark.parametrize("case", READABLE, ids=[case.name for case in READABLE])
def test_the_printed_dialect_of_any_table_reads_the_same_numbers(log, case):
    path = log(case.content)
    found = Csv().columns(path)
    pins = read_pins(tomllib.loads(found.dialect)["csv"], Place("machine.toml", "csv."))
    numbers = [i for i, name in enumerate(found.names) if name in found.columns and found.columns[name].unit != "s"]
    sources = tuple(
        ChannelSource(f"c{i}", (i,)) for i in {*numbers, len(found.names) - 1} if found.names[i] in found.columns
    )
    wanted = ChannelMap(TimeSource(rate=1.0), sources, ("axis",), pins=pins)
    if any(finding.kind == "unread_cells" for finding in found.findings):  # only accepted in a survey
        with pytest.raises(RecordingError, match=r"is not a number"):
            Csv().columns(path, wanted)
        return
    again = Csv().columns(path, wanted)
    for name in again.columns:
        assert np.array_equal(again.columns[name].values, found.columns[name].values, equal_nan=True), name


@pytest.mark.parametrize("above", ["# made by hand\n", "rig 4\n\n", "rig 4\nrun 7\n\n"])
def test_the_dialect_of_one_log_reads_a_log_with_another_preamble(log, machine, above):
    table = "t;i_motor;n_motor\nms;A;rad/s\n" + ROWS.partition("\n")[2].replace("25;", "5;")
    block = Csv().columns(log("rig 4\n\n" + table)).dialect
    assert (
        Csv().columns(log(above + table), machine(COLUMNS + block + "\n").columns).columns["n_motor"].values[19] == 19
    )


@pytest.mark.parametrize("head", ["# t x", "%t,x", "// t x", "# t x\n# [s] [N]"])
def test_the_dialect_of_a_table_with_names_in_a_comment_can_be_pasted(log, machine, head):
    separator = "," if "," in head else " "
    path = log(head + "\n" + "".join(f"{i}{separator}{i}.5\n" for i in range(9)))
    channels = '[channels]\ntime = { column = "t", unit = "s" }\nspeed = { column = "x", unit = "rad/s" }\n'
    wanted = machine(channels + Csv().columns(path).dialect + "\n").columns
    assert Csv().columns(path, wanted).columns["x"].values.tolist() == [i + 0.5 for i in range(9)]


def test_dates_are_a_clock_in_seconds_with_an_origin(log, machine):
    rows = "t,i_motor,n_motor\n" + "".join(f"2025-04-03T12:00:00.{i:03d}Z,1,{i}\n" for i in range(20))
    recording = read_recording(log(rows), machine(COLUMNS.replace('"ms"', '"s"')))
    assert recording["speed"].time.tolist() == [i / 1000 for i in range(20)]
    assert np.datetime64(int(recording.origin), "s") == np.datetime64("2025-04-03T12:00:00")
    with pytest.raises(RecordingError, match="has dates or times of day"):
        read_recording(log(rows), machine())


def test_a_counter_with_a_rate_is_a_clock_with_its_gaps(log, machine):
    rows = "n,i_motor,n_motor\n" + "".join(f"{i if i < 10 else i + 5},1,{i}\n" for i in range(20))
    clock = COLUMNS.replace('time = { column = "t", unit = "ms" }', 'time = { column = "n", rate_hz = 500 }')
    recording = read_recording(log(rows), machine(clock))
    assert np.allclose(recording["speed"].time, [0.002 * (i if i < 10 else i + 5) for i in range(20)])
    assert any(finding.kind == "sample_gaps" and finding.numbers["count"] == 1 for finding in recording.findings)
