from __future__ import annotations

import math

import pytest

from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding
from cdtool.formats.column_names import column_key
from cdtool.formats.csv import Csv


def read(path, wanted=None):
    return Csv().columns(path, wanted)


def values(source, name):
    return source.columns[name].values.tolist()


@pytest.mark.parametrize("separator", [",", ";", "\t", "|", " ", "   "])
def test_the_separator_is_detected(log, separator):
    rows = [["t", "a", "b"], ["0", "1.5", "-2"], ["1", "2.5", "1e-3"]]
    source = read(log("\n".join(separator.join(row) for row in rows) + "\n"))
    assert list(source.columns) == ["t", "a", "b"]
    assert values(source, "a") == [1.5, 2.5]
    assert values(source, "b") == [-2.0, 1e-3]


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("last", [True, False])
def test_all_kinds_of_line_ends_give_the_same_rows(log, end, last):
    source = read(log(end.join(["t,a", "0,1", "1,2", "2,3"]) + (end if last else "")))
    assert values(source, "a") == [1, 2, 3]
    assert not source.findings


def test_a_trace_of_codesys_is_a_table_below_two_lines_of_words(log):
    """The scheme of "Trace in ASCII file" in the manual of its editor."""
    head = "BODAS Trace\nD:\\BODAS\\PROJECTS\\TRAFFICSIGNAL.PRO\nCycle PLC_PRG.COUNTER PLC_PRG.LIGHT1\n"
    source = read(log(head + "".join(f"{i} {i // 3} {i % 2}\n" for i in range(30)), "trace.txt"))
    assert list(source.columns) == ["Cycle", "PLC_PRG.COUNTER", "PLC_PRG.LIGHT1"]
    assert values(source, "PLC_PRG.COUNTER") == [float(i // 3) for i in range(30)]


def test_a_file_without_header_has_its_columns_by_number(log):
    source = read(log("0,1.5\n1,2.5\n"))
    assert list(source.columns) == ["0", "1"]
    assert column_key(1, source.names) == "1"
    assert source.first_row == 1
    assert source.details["header"] == "none: columns by number"


def test_a_unit_in_the_header_is_read_and_may_be_omitted_in_the_name(log):
    source = read(log("t [ms],torque (Nm),q[0],q[1]\n0,1,2,3\n"))
    assert source.columns["torque (Nm)"].unit == "Nm"
    assert source.columns["t [ms]"].unit == "ms"
    assert source.columns["q[0]"].unit is None
    assert column_key("torque", source.names) == "torque (Nm)"
    assert column_key("q", source.names) is None


def test_a_name_that_two_columns_share_without_their_units_is_ambiguous(log):
    names = read(log("f [N],f [V]\n0,1\n")).names
    assert column_key("f", names) is None
    assert column_key("f [V]", names) == "f [V]"


def test_comment_lines_before_the_header_are_skipped_and_counted(log):
    source = read(log("# rig 3\n\n# 1 kHz\nt,a\n0,1\n"))
    assert values(source, "a") == [1]
    assert source.details["header"] == "line 4"
    assert source.first_row == 5


@pytest.mark.parametrize("separator", [";", "\t"])
def test_a_decimal_comma_is_read_as_one(log, separator):
    source = read(log(f"t{separator}a\n0{separator}1,5\n1{separator}-2,25e1\n"))
    assert values(source, "a") == [1.5, -22.5]
    assert source.details["decimal mark"] == "comma"


def test_a_point_as_thousands_separator_with_a_decimal_comma_is_read(log, machine):
    source = read(log("t;i_motor;n_motor\n0;1,5;0\n1;1.234,5;0\n2;1,5;0\n"), machine().columns)
    assert values(source, "i_motor") == [1.5, 1234.5, 1.5]


def test_a_misplaced_point_in_a_column_with_decimal_commas_is_refused(log, machine):
    path = log("t;i_motor;n_motor\n0;1,5;0\n1;1.23,5;0\n2;1,5;0\n")
    with pytest.raises(RecordingError, match=r"line 3, column 'i_motor': '1\.23,5' is not a number"):
        read(path, machine().columns)


def test_a_byte_order_mark_is_not_part_of_the_first_name(log):
    source = read(log("t,ä\n0,1\n".encode("utf-8-sig")))
    assert list(source.columns) == ["t", "ä"]
    assert values(source, "t") == [0]


def test_a_byte_order_mark_before_numbers_is_skipped(log):
    assert values(read(log("1,2.5\n3,4.5\n".encode("utf-8-sig"))), "0") == [1, 3]


def test_latin_1_is_read_with_a_finding(log):
    source = read(log("t,größe\n0,1\n".encode("latin-1")))
    assert list(source.columns) == ["t", "größe"]
    assert source.findings[0] == Finding("other_encoding", "", {"encoding": "Latin-1"})


def test_empty_cells_and_nan_are_missing_values(log):
    source = read(log("t,a\n0,\n1,nan\n2,NaN\n3,4\n"))
    assert [math.isnan(value) for value in values(source, "a")] == [True, True, True, False]


def test_quoted_cells_may_contain_the_separator(log):
    source = read(log('"t","torque, motor"\n"0","1.5"\n"1","2.5"\n'))
    assert values(source, "torque, motor") == [1.5, 2.5]


def test_only_the_wanted_columns_are_read(log, machine):
    source = read(log("t,note,i_motor,n_motor\n0,up,1,2\n1,down,3,4\n"), machine().columns)
    assert list(source.columns) == ["t", "i_motor", "n_motor"]
    assert source.names == ("t", "note", "i_motor", "n_motor")


def test_a_column_of_words_is_left_out_of_a_survey_and_named(log):
    source = read(log("t,note\n0,up\n1,down\n"))
    assert list(source.columns) == ["t"]
    assert source.findings[0] == Finding("not_numeric", "", {"column": "note", "line": 2, "cell": "up", "advice": None})


@pytest.mark.parametrize("text", ["abc", "1.5 V", "1_000", "NA", "0x10", "1 234"])
def test_a_cell_that_is_not_a_number_is_named_with_line_column_and_text(log, machine, text):
    path = log(f"# made by hand\nt,i_motor,n_motor\n0,1,2\n1,{text},3\n2,3,4\n")
    with pytest.raises(RecordingError) as fault:
        read(path, machine().columns)
    assert fault.value.message == f"{path}: line 4, column 'i_motor': '{text}' is not a number"


def test_the_line_of_a_bad_cell_counts_blank_lines(log, machine):
    path = log("t,i_motor,n_motor\n\n0,1,2\n\n\n1,x,3\n2,3,4\n")
    with pytest.raises(RecordingError, match="line 6, column 'i_motor'"):
        read(path, machine().columns)


@pytest.mark.parametrize(("row", "width"), [("1,2", 2), ("1,2,3,4", 4)])
def test_a_ragged_row_is_an_error_with_its_line(log, machine, row, width):
    path = log(f"t,i_motor,n_motor\n0,1,2\n{row}\n2,3,4\n")
    for wanted in (None, machine().columns):
        with pytest.raises(RecordingError, match=f"line 3 has {width} cells, the header has 3"):
            read(path, wanted)


@pytest.mark.parametrize("last", ["2", "2,3", "2,3,-", "2,3,1e", "\0\0\0\0"])
def test_a_half_written_last_line_is_dropped_with_a_finding(log, machine, last):
    source = read(log(f"t,i_motor,n_motor\n0,1,2\n1,2,3\n{last}"), machine().columns)
    assert values(source, "n_motor") == [2, 3]
    assert source.findings[0] == Finding("last_line_cut", "", {"line": 4})


def test_a_short_last_line_with_its_end_is_ragged(log):
    with pytest.raises(RecordingError, match="line 3 has 1 cell"):
        read(log("t,a\n0,1\n2\n"))


def test_a_duplicate_name_matters_only_if_it_is_requested(log, machine):
    assert values(read(log("t,i_motor,n_motor,x,x\n0,1,2,3,4\n"), machine().columns), "i_motor") == [1]
    path = log("t,i_motor,n_motor,n_motor\n0,1,2,3\n")
    with pytest.raises(RecordingError, match=r"2 columns have the name 'n_motor' .*2 or 3"):
        read(path, machine().columns)
    numbered = machine(
        '[channels]\ntime = { column = "t", unit = "ms" }\nspeed = { column = 3, unit = "rad/s" }\n'
    ).columns
    assert [column.values.tolist() for column in read(path, numbered).columns.values()] == [[0], [3]]


def test_a_missing_column_is_named_with_its_channel_and_the_nearest(log, machine):
    path = log("t,i_moter,n\n0,1,2\n")
    with pytest.raises(RecordingError) as fault:
        read(path, machine().columns)
    assert fault.value.message == f"{path}: no column 'i_motor' (channel 'torque')"
    assert "did you mean i_moter" in fault.value.hint


def test_a_column_number_beyond_the_file_is_an_error(log, machine):
    wanted = machine('[channels]\ntime = { column = 0, unit = "s" }\nspeed = { column = 7, unit = "rad/s" }\n').columns
    with pytest.raises(RecordingError, match=r"no column 7 .*numbered from 0 to 1"):
        read(log("0,1.5\n1,2.5\n"), wanted)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "is empty"),
        (b"\n\n  \n", "is empty"),
        (b"t,a\n", "contains a header in line 1 and no row of numbers"),
        (b"# only\n# comments\n", "contains no row of numbers"),
        (b"some words\nand more words\n", "contains no row of numbers: line 2"),
        (b"t,a\n\x00\x01\x02\x03,\xff\n", "binary"),
        (b"\x89PNG\r\n\x1a\n1,2", "binary or markup"),
        (b"<html><body>1,2</body></html>", "binary or markup"),
        ("t,a\n0,1\n".encode("utf-16")[:-1] + b"\xd8", "UTF-16"),
        (b't,a\n0,"1\n2,3\n4,5\n', "cells|quotes|table"),
    ],
)
def test_anything_but_a_table_of_numbers_is_refused_in_one_line(log, content, message):
    path = log(content)
    with pytest.raises(RecordingError, match=message) as fault:
        read(path)
    assert str(path) in fault.value.message
    assert "\n" not in str(fault.value)


def test_mixed_line_ends_are_never_read_silently_wrong(log):
    with pytest.raises(RecordingError):
        read(log(b"t,a\n0,1\r1,2\n2,3\n"))


def test_many_rows_pass_the_blockwise_check(log, monkeypatch):
    monkeypatch.setattr("cdtool.formats.csv.text.BLOCK_BYTES", 64)
    lines = [f"{i},{i * 0.5}" for i in range(1000)]
    assert len(values(read(log("t,a\n" + "\n".join(lines))), "a")) == 1000
    lines[700] += ",1"
    with pytest.raises(RecordingError, match="line 702 has 3 cells"):
        read(log("t,a\n" + "\n".join(lines)))
