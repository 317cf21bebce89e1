"""Names, units and columns of text tables, and errors that name line, column and cell. Dialects: csv_cases.py."""

from __future__ import annotations

import re

import pytest

from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding
from cdtool.formats.column_names import column_key
from cdtool.formats.csv import Csv


def values(source, name):
    return source.columns[name].values.tolist()


def test_a_trace_of_codesys_is_a_table_below_two_lines_of_words(log):
    """The scheme of "Trace in ASCII file" in the manual of its editor."""
    head = "BODAS Trace\nD:\\BODAS\\PROJECTS\\TRAFFICSIGNAL.PRO\nCycle PLC_PRG.COUNTER PLC_PRG.LIGHT1\n"
    source = Csv().columns(log(head + "".join(f"{i} {i // 3} {i % 2}\n" for i in range(30)), "trace.txt"))
    assert list(source.columns) == ["Cycle", "PLC_PRG.COUNTER", "PLC_PRG.LIGHT1"]
    assert values(source, "PLC_PRG.COUNTER") == [float(i // 3) for i in range(30)]


@pytest.mark.parametrize(
    ("content", "first_row", "header"),
    [("0,1.5\n1,2.5\n", 1, "none: columns by number"), ("# rig 3\n\n# 1 kHz\nt,a\n0,1\n", 5, "line 4")],
)
def test_the_line_of_the_header_and_of_the_first_row_are_known(log, content, first_row, header):
    source = Csv().columns(log(content))
    assert (source.first_row, source.details["header"]) == (first_row, header)
    assert column_key(1, source.names) == source.names[1]


def test_a_unit_in_the_header_is_read_and_may_be_omitted_in_the_name(log):
    source = Csv().columns(log("t [ms],torque (Nm),q[0],q[1],f [N],f [V]\n0,1,2,3,4,5\n"))
    assert [column.unit for column in source.columns.values()] == ["ms", "Nm", None, None, "N", "V"]
    keys = {name: column_key(name, source.names) for name in ("torque", "q", "f", "f [V]")}
    assert keys == {"torque": "torque (Nm)", "q": None, "f": None, "f [V]": "f [V]"}


def test_other_encodings_and_columns_of_words_are_notes_of_a_survey(log):
    source = Csv().columns(log("t,größe,note\n0,1,up\n1,2,down\n".encode("latin-1")))
    assert list(source.columns) == ["t", "größe"]
    assert source.findings[:2] == (
        Finding("other_encoding", "", {"encoding": "Latin-1"}),
        Finding("not_numeric", "", {"column": "note", "line": 2, "cell": "up", "advice": None}),
    )


def test_only_the_wanted_columns_are_read(log, machine):
    source = Csv().columns(log("t,note,i_motor,n_motor,x,x\n0,up,1,2,7,7\n1,down,3,4,7,7\n"), machine().columns)
    assert list(source.columns) == ["t", "i_motor", "n_motor"] and values(source, "i_motor") == [1, 3]
    assert source.names[:4] == ("t", "note", "i_motor", "n_motor") and len(source.names) == 6


def test_thousands_are_read_in_numbers_with_decimal_commas(log, machine):
    source = Csv().columns(log("t;i_motor;n_motor\n0;1,5;0\n1;1.234,5;0\n2;1,5;0\n"), machine().columns)
    assert values(source, "i_motor") == [1.5, 1234.5, 1.5]


HEAD = "t,i_motor,n_motor\n"
REFUSED = {
    "a wrong thousands separator": (
        "t;i_motor;n_motor\n0;1,5;0\n1;1.23,5;0\n2;1,5;0\n",
        "line 3, column 'i_motor': '1.23,5' is not a number",
    ),
    **{
        f"a cell {cell!r}": (
            f"# hand\n{HEAD}0,1,2\n1,{cell},3\n2,3,4\n",
            f"line 4, column 'i_motor': '{cell}' is not a",
        )
        for cell in ("abc", "1.5 V", "1_000", "NA", "0x10", "1 234")
    },
    "below blank lines": (f"{HEAD}\n0,1,2\n\n\n1,x,3\n2,3,4\n", "line 6, column 'i_motor'"),
    "a short row": (f"{HEAD}0,1,2\n1,2\n2,3,4\n", "line 3 has 2 cells, the header has 3"),
    "a long row": (f"{HEAD}0,1,2\n1,2,3,4\n2,3,4\n", "line 3 has 4 cells, the header has 3"),
    "a short last row": (f"{HEAD}0,1,2\n1\n", "line 3 has 1 cell"),
    "two columns of that name": ("t,i_motor,n_motor,n_motor\n0,1,2,3\n", "2 columns have the name 'n_motor'"),
    "another name": ("t,i_moter,n\n0,1,2\n", "no column 'i_motor' (channel 'torque') (did you mean i_moter"),
    "mixed line ends": (f"{HEAD}0,1,2\r1,2,3\n2,3,4\n", "line"),
}


@pytest.mark.parametrize(("content", "message"), REFUSED.values(), ids=REFUSED)
def test_a_table_that_cannot_be_mapped_is_refused_with_line_column_and_cell(log, machine, content, message):
    path = log(content)
    with pytest.raises(RecordingError, match=re.escape(message)) as fault:
        Csv().columns(path, machine().columns)
    assert fault.value.message.startswith(f"{path}: ") and "\n" not in str(fault.value)


@pytest.mark.parametrize("last", ["2", "2,3", "2,3,-", "2,3,1e", "\0\0\0\0"])
def test_a_half_written_last_line_is_dropped_with_a_finding(log, machine, last):
    source = Csv().columns(log(f"{HEAD}0,1,2\n1,2,3\n{last}"), machine().columns)
    assert values(source, "n_motor") == [2, 3]
    assert source.findings[0] == Finding("last_line_cut", "", {"line": 4})


def test_columns_have_numbers_from_0(log, machine):
    channels = '[channels]\ntime = { column = "t", unit = "s" }\nspeed = { column = 3, unit = "rad/s" }\n'
    path = log("t,a,a,a\n0,1,2,3\n")
    read = Csv().columns(path, machine(channels).columns).columns
    assert [column.values.tolist() for column in read.values()] == [[0], [3]]
    with pytest.raises(RecordingError, match=r"no column 7 .*numbered from 0 to 3"):
        Csv().columns(path, machine(channels.replace("3", "7")).columns)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is empty"),
        (b"\n\n  \n", "is empty"),
        (b"t,a\n", "contains a header in line 1 and no row of numbers"),
        (b"# only\n# comments\n", "contains no row of numbers"),
        (b"some words\nand more words\n", "contains no row of numbers: line 2"),
        (b"t,a\n\x00\x01\x02\x03,\xff\n", "binary"),
        ("t,a\n0,1\n".encode("utf-16")[:-1] + b"\xd8", "UTF-16"),
        (b't,a\n0,"1\n2,3\n4,5\n', "cells|quotes|table"),
        (b"\x1b[31mt;x\n0;1\n1;2\n", r"line 1 contains a control character \(byte 0x1b\)"),
        (b"t;" + b"c;" * 70_000 + b"x\n" + b"0;" * 70_000 + b"1\n", "line 1 continues after the first 128 KB"),
    ],
)
def test_anything_but_a_table_of_numbers_is_refused_in_one_line(log, content, message):
    path = log(content)
    with pytest.raises(RecordingError, match=message) as fault:
        Csv().columns(path)
    assert str(path) in fault.value.message and "\n" not in str(fault.value)


def test_many_rows_pass_the_blockwise_check(log, monkeypatch):
    monkeypatch.setattr("cdtool.formats.csv.text.BLOCK_BYTES", 64)
    lines = [f"{i},{i * 0.5}" for i in range(1000)]
    assert len(values(Csv().columns(log("t,a\n" + "\n".join(lines))), "a")) == 1000
    lines[700] += ",1"
    with pytest.raises(RecordingError, match="line 702 has 3 cells"):
        Csv().columns(log("t,a\n" + "\n".join(lines)))
