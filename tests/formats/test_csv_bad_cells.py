"""Cells and lines that cannot be read: the first one is named with a hint; `info` still reads the column."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding, lines_of
from cdtool.formats.channels.reading import choose_format, read_recording
from cdtool.formats.csv import Csv
from tests.base.findings.facts import fact_of

SECONDS = '[channels]\ntime = { column = 0, unit = "s" }\nspeed = { column = 1, unit = "rad/s" }\n'
STAMPS = ["23:59:58.5", "23:59:59.0", "23:59:59.5"]


def findings_of(source, severity: str) -> list[Finding]:
    return [finding for finding in source.findings if finding.severity == severity]


@pytest.mark.parametrize("cell", ["n/a", "-", "#N/A", "OVL", "#WERT!"])
def test_a_word_in_a_column_of_numbers_is_a_loss_to_a_survey_and_an_error_with_a_hint(log, machine, cell):
    path = log("t;x\n" + "".join(f"{i};{cell if i == 4 else i}\n" for i in range(20)))
    source = Csv().columns(path)
    assert np.flatnonzero(np.isnan(source.columns["x"].values)).tolist() == [4]
    (loss,) = findings_of(source, "loss")
    assert loss == Finding(
        "unread_cells", "x", {**lines_of((6,)), "cell": cell, "advice": {"looks_like": "word", "text": f'"{cell}"'}}
    )
    with pytest.raises(RecordingError, match=r"line 6, column 'x': .* is not a number") as fault:
        read_recording(path, machine(SECONDS))
    assert f'missing = ["{cell}"] in [csv]' in fault.value.hint
    recording = read_recording(path, machine(SECONDS + f'[csv]\nmissing = ["{cell}"]\n'))
    assert np.isnan(recording["speed"].values[4, 0]) and len(recording["speed"].values) == 20


def test_a_column_with_many_words_is_left_out_with_a_warning(log):
    path = log("t;x\n" + "".join(f"{i};{'idle' if i % 5 == 0 else i}\n" for i in range(100)))
    source = Csv().columns(path)
    assert list(source.columns) == ["t"]
    (warning,) = findings_of(source, "warning")
    assert fact_of(warning) == (
        "not_numeric",
        {"column": "x", "line": 2, "cell": "idle", "advice": {"looks_like": "word", "text": '"idle"'}},
    )


@pytest.mark.parametrize("cell", ["#N/A", "#DIV/0!", "#WERT!", "#####", "#error"])
@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_a_row_that_starts_with_an_error_value_of_excel_is_a_row(log, cell, separator):
    lines = [f"{i}{separator}{i}.5" for i in range(9)]
    lines[4] = f"{cell}{separator}4.5"
    source = Csv().columns(log(f"t{separator}x\n" + "\n".join(lines) + "\n"))
    assert source.columns["x"].values.tolist() == [i + 0.5 for i in range(9)]
    assert len(findings_of(source, "loss")) == 1 and not findings_of(source, "note")


@pytest.mark.parametrize("comment", ["# paused, by hand", "#4,4.5", "# 4,4.5", "#paused"])
def test_a_commented_line_of_words_or_row_is_a_comment(log, comment):
    lines = [f"{i},{i}.5" for i in range(9)]
    lines[4] = comment
    source = Csv().columns(log("t,x\n" + "\n".join(lines) + "\n"))
    assert len(source.columns["x"].values) == 8
    assert findings_of(source, "note") == [Finding("comment_lines", "", lines_of((6,)))]


@pytest.mark.parametrize("bad", ["24:00:00.0", "23:59:60", "12:61:00", "24:00"])
@pytest.mark.parametrize("at", [0, 1, 3])
def test_the_first_time_that_matches_no_layout_is_named(log, machine, bad, at):
    stamps = [*STAMPS[:at], bad, *STAMPS[at:]]
    path = log("t;x\n" + "".join(f"{stamp};1\n" for stamp in stamps))
    with pytest.raises(
        RecordingError, match=rf"line {at + 2}, column 't': '{bad}' is not a time with the layout %H:%M:%S\.%f"
    ) as e:
        read_recording(path, machine(SECONDS))
    assert "time_format" in e.value.hint and "decimal mark" not in str(e.value)
    source = Csv().columns(path)
    assert np.flatnonzero(np.isnan(source.columns["t"].values)).tolist() == [at]
    assert findings_of(source, "loss") == [
        Finding("unread_cells", "t", {**lines_of((at + 2,)), "cell": bad, "advice": {"looks_like": "time", "text": ""}})
    ]


def test_dates_with_an_unknown_layout_are_named_with_time_format(log, machine):
    path = log("t;x\n" + "".join(f"04.13.2025 12:00:0{i};1\n" for i in range(5)))
    with pytest.raises(RecordingError, match=r"line 2, .* nor a date or time with a known layout") as fault:
        read_recording(path, machine(SECONDS))
    assert "time_format" in fault.value.hint
    layout = SECONDS + '[csv]\ntime_format = "%m.%d.%Y %H:%M:%S"\n'
    assert read_recording(path, machine(layout))["speed"].time.tolist() == [0, 1, 2, 3, 4]


@pytest.mark.parametrize("head", ["", "t;x;y\n"], ids=["no header", "header"])
def test_a_first_row_of_empty_cells_is_not_a_header(log, head):
    source = Csv().columns(log(head + ";;\n0;1;2\n1;2;3\n"))
    assert list(source.columns) == (["t", "x", "y"] if head else ["0", "1", "2"])
    assert source.columns[list(source.columns)[1]].values.tolist() == [1, 2]
    assert len(findings_of(source, "note")) == 1


def test_a_line_longer_than_the_sample_is_named(log):
    wide = "t;" + ";".join(f"c{i}" for i in range(60_000))
    with pytest.raises(RecordingError, match="line 1 continues after the first 128 KB"):
        Csv().columns(log(wide + "\n" + "0;" * 60_000 + "1\n"))


def test_a_control_character_in_the_header_is_named(log):
    path = log("\x1b[31mt;x\n0;1\n1;2\n")
    with pytest.raises(RecordingError, match=r"line 1 contains a control character \(byte 0x1b\)"):
        choose_format(path).columns(path)


def test_the_unit_labels_of_labview_are_the_units_of_its_columns(log):
    head = "LabVIEW Measurement\t\nWriter_Version\t2\n***End_of_Header***\t\n\nChannels\t2\t\n"
    head += "Y_Unit_Label\tN*m\trpm\nX_Dimension\tTime\tTime\nDelta_X\t0.001\t0.001\n***End_of_Header***\t\t\n"
    rows = "".join(f"{0.001 * i:.3f}\t{i}.5\t{i}\n" for i in range(40))
    source = Csv().columns(log(head + "X_Value\tTorque\tSpeed\tComment\n" + rows, "log.lvm"))
    assert [source.columns[name].unit for name in ("X_Value", "Torque", "Speed")] == [None, "N*m", "rpm"]


@pytest.mark.parametrize(
    ("comment", "units"),
    [
        ("# s,mm,mm/s", ["s", "mm", "mm/s"]),
        ("#s,mm,mm/s,", ["s", "mm", "mm/s"]),
        ("# rig 3,12,left", [None, None, None]),
        ("# s,mm", [None, None, None]),
        ("# s,mm,mm/s\n# rig 3", [None, None, None]),
    ],
    ids=["units", "a separator at the end", "words", "fewer cells", "not directly above"],
)
def test_units_in_a_comment_directly_above_the_names_are_read(log, comment, units):
    end = "," if comment.endswith(",") else ""
    rows = "".join(f"{0.01 * i:.2f},{i}.5,{i}{end}\n" for i in range(40))
    path = log(f"{comment}\ntime,Position,Speed{end}\n{rows}", "log.csv")
    source = choose_format(path).columns(path)
    assert [source.columns[name].unit for name in ("time", "Position", "Speed")] == units


@pytest.mark.parametrize("cell", ["null", "NULL", "None", "<NA>"])
def test_what_programs_write_for_no_value_is_a_missing_sample(log, machine, cell):
    path = log("t;x;y\n" + "".join(f"{i};{cell if i in (0, 4) else i};{cell}\n" for i in range(40)))
    source = Csv().columns(path)
    assert np.flatnonzero(np.isnan(source.columns["x"].values)).tolist() == [0, 4]
    assert not findings_of(source, "loss")
    assert len(read_recording(path, machine(SECONDS))["speed"].values) == 40


def ending_early(first: str, others: str, count: int = 300) -> str:
    rows = "".join(f"{0.01 * i:.2f},{i}.5{others}\n" for i in range(1, count))
    return f"t,x,largest x,mean x\n0.00,0.5{first}\n{rows}"


def test_columns_with_a_value_in_the_first_row_only_are_read(log, machine):
    """The statistics of a measurement, which a program writes into its first row."""
    path = log(ending_early(",299.5,150.0", ""), "log.csv")
    source = choose_format(path).columns(path)
    assert list(source.columns) == ["t", "x", "largest x", "mean x"]
    np.testing.assert_array_equal(source.columns["x"].values, np.arange(300) + 0.5)
    assert source.columns["largest x"].values[0] == 299.5
    assert np.isnan(source.columns["largest x"].values[1:]).all()
    assert len(read_recording(path, machine(SECONDS))["speed"].values) == 300


@pytest.mark.parametrize(
    ("first", "others"),
    [(",299.5,150.0", ",1"), (",299.5", ""), (",a,b", "")],
    ids=["fewer names than that", "a first row of another width", "words in the first row"],
)
def test_other_rows_of_two_widths_are_refused(log, first, others):
    text = ending_early(first, others)
    text = text.replace("\n0.05,", "\n0.05,7,") if others else text
    path = log(text, "log.csv")
    with pytest.raises(RecordingError, match=r"cells|names"):
        choose_format(path).columns(path)


@pytest.mark.parametrize("cut", ["500.00", "500.00,50000.5,9.0"], ids=["one cell", "a further cell"])
def test_among_rows_that_end_early_a_row_of_another_width_is_an_error(log, machine, cut):
    text = ending_early(",299.5,150.0", "", 60000).replace("\n500.00,50000.5\n", f"\n{cut}\n")
    with pytest.raises(RecordingError, match="line 50002 has"):
        read_recording(log(text, "log.csv"), machine(SECONDS))


def test_between_blanks_rows_with_fewer_cells_are_refused(log):
    """The set value is logged once: where it is missing, the other cells would be in the wrong columns."""
    rows = "".join(f"{0.01 * i:.2f} {i}.5 {i}\n" for i in range(1, 300))
    with pytest.raises(RecordingError, match="cells"):
        path = log(f"t set pos vel\n0.00 5.0 0.5 0\n{rows}", "log.txt")
        choose_format(path).columns(path)


@pytest.mark.parametrize(
    "end", ["", "14:05:59;4", "14:05:59;", "14:05:5"], ids=["complete", "cut", "cut at ;", "cut before ;"]
)
def test_a_semicolon_in_times_does_not_separate_cells_even_if_the_last_line_is_cut_off(log, end):
    rows = "".join(f"14:05:{i // 10:02d};{100 * (i % 10):03d},{i}.5,1.5\n" for i in range(300))
    path = log(f"Trend:,gate\nStart:,14:05:00;000\n\nTime,pos,vel\n{rows}{end}", "log.csv")
    source = choose_format(path).columns(path)
    np.testing.assert_array_equal(source.columns["pos"].values, np.arange(300) + 0.5)


@pytest.mark.parametrize("above", ["", "Gate 3\n", "Time;Force\n", "Time Force\n"])
def test_a_semicolon_between_a_time_and_a_number_separates_them(log, above):
    rows = "".join(f"14:{i // 60:02d}:{i % 60:02d};{100 + i}\n" for i in range(300))
    path = log(above + rows, "log.csv")
    first, second = choose_format(path).columns(path).columns.values()
    np.testing.assert_array_equal(second.values, np.arange(300) + 100.0)
    assert first.values[1] - first.values[0] == 1.0
