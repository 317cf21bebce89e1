"""Lines that are not rows, and cells that are not numbers: no sample is lost in silence, none is made up."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding, lines_of
from cdtool.formats.channels.channel_map import TablePins
from cdtool.formats.channels.reading import read_recording
from cdtool.formats.csv import Csv
from cdtool.formats.csv_dialect.find_dialect import find_dialect
from cdtool.formats.pieces import PieceRun, join_pieces
from tests.base.findings.facts import fact_of

SECONDS = '[channels]\ntime = { column = 0, unit = "s" }\nspeed = { column = 1, unit = "rad/s" }\n'
ROWS = [f"{i},{i}.5" for i in range(9)]


def with_severity(source, severity: str) -> list[Finding]:
    return [finding for finding in source.findings if finding.severity == severity]


def of_kind(source, kind: str) -> list[tuple]:
    return [fact_of(finding) for finding in source.findings if finding.kind == kind]


# --- Cells


@pytest.mark.parametrize("cell", ["n/a", "-", "#N/A", "OVL", "#WERT!"])
def test_a_word_in_a_column_of_numbers_is_a_loss_to_a_survey_and_an_error_with_a_hint(log, machine, cell):
    path = log("t;x\n" + "".join(f"{i};{cell if i == 4 else i}\n" for i in range(20)))
    source = Csv().columns(path)
    assert np.flatnonzero(np.isnan(source.columns["x"].values)).tolist() == [4]
    (loss,) = with_severity(source, "loss")
    assert loss == Finding(
        "unread_cells", "x", {**lines_of((6,)), "cell": cell, "advice": {"looks_like": "word", "text": f'"{cell}"'}}
    )
    with pytest.raises(RecordingError, match=r"line 6, column 'x': .* is not a number") as fault:
        read_recording(path, machine(SECONDS))
    assert f'missing = ["{cell}"] in [csv]' in fault.value.hint
    recording = read_recording(path, machine(SECONDS + f'[csv]\nmissing = ["{cell}"]\n'))
    assert np.isnan(recording["speed"].values[4, 0]) and len(recording["speed"].values) == 20


def test_a_column_with_many_words_is_left_out_with_a_warning(log):
    source = Csv().columns(log("t;x\n" + "".join(f"{i};{'idle' if i % 5 == 0 else i}\n" for i in range(100))))
    assert list(source.columns) == ["t"]
    assert [finding.kind for finding in with_severity(source, "warning")] == ["not_numeric"]


@pytest.mark.parametrize("cell", ["null", "NULL", "None", "<NA>"])
def test_what_programs_write_for_no_value_is_a_missing_sample(log, machine, cell):
    path = log("t;x;y\n" + "".join(f"{i};{cell if i in (0, 4) else i};{cell}\n" for i in range(40)))
    source = Csv().columns(path)
    assert np.flatnonzero(np.isnan(source.columns["x"].values)).tolist() == [0, 4]
    assert not with_severity(source, "loss")
    assert len(read_recording(path, machine(SECONDS))["speed"].values) == 40


@pytest.mark.parametrize("bad", ["24:00:00.0", "23:59:60", "12:61:00", "24:00"])
@pytest.mark.parametrize("at", [0, 1, 3])
def test_the_first_time_that_matches_no_layout_is_named(log, machine, bad, at):
    stamps = ["23:59:58.5", "23:59:59.0", "23:59:59.5"]
    path = log("t;x\n" + "".join(f"{stamp};1\n" for stamp in [*stamps[:at], bad, *stamps[at:]]))
    said = rf"line {at + 2}, column 't': '{bad}' is not a time with the layout %H:%M:%S\.%f"
    with pytest.raises(RecordingError, match=said) as fault:
        read_recording(path, machine(SECONDS))
    assert "time_format" in fault.value.hint
    source = Csv().columns(path)
    assert np.flatnonzero(np.isnan(source.columns["t"].values)).tolist() == [at]
    assert [finding.kind for finding in with_severity(source, "loss")] == ["unread_cells"]


def test_dates_with_an_unknown_layout_are_named_with_time_format(log, machine):
    path = log("t;x\n" + "".join(f"04.13.2025 12:00:0{i};1\n" for i in range(5)))
    with pytest.raises(RecordingError, match=r"line 2, .* nor a date or time with a known layout") as fault:
        read_recording(path, machine(SECONDS))
    assert "time_format" in fault.value.hint
    layout = SECONDS + '[csv]\ntime_format = "%m.%d.%Y %H:%M:%S"\n'
    assert read_recording(path, machine(layout))["speed"].time.tolist() == [0, 1, 2, 3, 4]


def ending_early(first: str, others: str, count: int = 300) -> str:
    rows = "".join(f"{0.01 * i:.2f},{i}.5{others}\n" for i in range(1, count))
    return f"t,x,largest x,mean x\n0.00,0.5{first}\n{rows}"


def test_columns_with_a_value_in_the_first_row_only_are_read(log, machine):
    """The statistics of a measurement, which a program writes into its first row."""
    path = log(ending_early(",299.5,150.0", ""))
    source = Csv().columns(path)
    np.testing.assert_array_equal(source.columns["x"].values, np.arange(300) + 0.5)
    assert source.columns["largest x"].values[0] == 299.5
    assert np.isnan(source.columns["largest x"].values[1:]).all()
    assert len(read_recording(path, machine(SECONDS))["speed"].values) == 300


LONG = ending_early(",299.5,150.0", "", 60_000)
BETWEEN_BLANKS = "t set pos vel\n0.00 5.0 0.5 0\n" + "".join(f"{0.01 * i:.2f} {i}.5 {i}\n" for i in range(1, 300))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (ending_early(",299.5,150.0", ",1").replace("\n0.05,", "\n0.05,7,"), "cells|names"),
        (ending_early(",299.5", ""), "cells|names"),
        (ending_early(",a,b", ""), "cells|names"),
        (LONG.replace("\n500.00,50000.5\n", "\n500.00\n"), "line 50002 has"),
        (LONG.replace("\n500.00,50000.5\n", "\n500.00,50000.5,9.0\n"), "line 50002 has"),
        (BETWEEN_BLANKS, "cells"),  # a set value is logged once: the other cells would be in the wrong columns
    ],
    ids=["a longer row", "another first row", "words", "a shorter row", "a longer row late", "between blanks"],
)
def test_other_rows_of_two_widths_are_refused(log, machine, text, message):
    with pytest.raises(RecordingError, match=message):
        read_recording(log(text), machine(SECONDS))


@pytest.mark.parametrize("end", ["", "14:05:59;4", "14:05:59;", "14:05:5"])
def test_a_semicolon_in_times_does_not_separate_cells_even_if_the_last_line_is_cut_off(log, end):
    rows = "".join(f"14:05:{i // 10:02d};{100 * (i % 10):03d},{i}.5,1.5\n" for i in range(300))
    source = Csv().columns(log(f"Trend:,gate\nStart:,14:05:00;000\n\nTime,pos,vel\n{rows}{end}"))
    np.testing.assert_array_equal(source.columns["pos"].values, np.arange(300) + 0.5)


@pytest.mark.parametrize("above", ["", "Gate 3\n", "Time;Force\n", "Time Force\n"])
def test_a_semicolon_between_a_time_and_a_number_separates_them(log, above):
    rows = "".join(f"14:{i // 60:02d}:{i % 60:02d};{100 + i}\n" for i in range(300))
    first, second = Csv().columns(log(above + rows)).columns.values()
    np.testing.assert_array_equal(second.values, np.arange(300) + 100.0)
    assert first.values[1] - first.values[0] == 1.0


# --- Lines between the rows


@pytest.mark.parametrize("cell", ["#N/A", "#DIV/0!", "#WERT!", "#####", "#error"])
@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_a_row_that_starts_with_an_error_value_of_excel_is_a_row(log, cell, separator):
    lines = [*ROWS[:4], f"{cell},4.5", *ROWS[5:]]
    source = Csv().columns(log("\n".join(["t,x", *lines, ""]).replace(",", separator)))
    assert source.columns["x"].values.tolist() == [i + 0.5 for i in range(9)]
    assert len(with_severity(source, "loss")) == 1 and not with_severity(source, "note")


@pytest.mark.parametrize("comment", ["# paused, by hand", "#4,4.5", "# 4,4.5", "#paused"])
def test_a_commented_line_of_words_or_row_is_a_comment(log, comment):
    source = Csv().columns(log("\n".join(["t,x", *ROWS[:4], comment, *ROWS[5:], ""])))
    assert len(source.columns["x"].values) == 8
    assert with_severity(source, "note") == [Finding("comment_lines", "", lines_of((6,)))]


@pytest.mark.parametrize("head", ["", "t;x;y\n"], ids=["no header", "header"])
def test_a_first_row_of_empty_cells_is_not_a_header(log, head):
    source = Csv().columns(log(head + ";;\n0;1;2\n1;2;3\n"))
    assert list(source.columns) == (["t", "x", "y"] if head else ["0", "1", "2"])
    assert source.columns[list(source.columns)[1]].values.tolist() == [1, 2]
    assert len(with_severity(source, "note")) == 1


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
    source = Csv().columns(log(f"{comment}\ntime,Position,Speed{end}\n{rows}"))
    assert [source.columns[name].unit for name in ("time", "Position", "Speed")] == units


def test_a_blank_line_in_one_column_is_a_missing_sample_with_its_time(log, machine):
    rate = '[channels]\ntime = { rate_hz = 100.0 }\nspeed = { column = "x", unit = "rad/s" }\n'
    recording = read_recording(log("x\n1.5\n2.5\n\n3.5\n4.5\n"), machine(rate))
    assert recording["speed"].time.tolist() == [0.0, 0.01, 0.02, 0.03, 0.04]
    assert np.isnan(recording["speed"].values[:, 0]).tolist() == [False, False, True, False, False]
    assert of_kind(recording, "blank_rows") == [("blank_rows", lines_of((4,)))]
    assert not with_severity(recording, "loss")


@pytest.mark.parametrize(
    ("text", "rows", "blank"),
    [
        ("t;x\n0;0.5\n\n1;1.5\n", 2, (3,)),
        ("x\n" + "".join(f"{i}.5\n\n" for i in range(9)), 9, tuple(range(3, 18, 2))),
    ],
    ids=["several columns", "every other line"],
)
def test_blank_lines_between_rows_of_several_cells_or_after_every_row_are_not_samples(log, text, rows, blank):
    source = Csv().columns(log(text))
    assert source.columns["x"].values.tolist() == [i + 0.5 for i in range(rows)]
    assert of_kind(source, "blank_lines") == [("blank_lines", lines_of(blank))]


@pytest.mark.parametrize("end", ["\n", "\n\n\n", "\n \t\n", "", "\n  "], ids=repr)
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_blank_lines_at_the_end_are_not_samples(log, end, encoding):
    source = Csv().columns(log(("x\n1.25\n\n2.25\n3.25" + end).encode(encoding)))
    assert np.array_equal(source.columns["x"].values, [1.25, np.nan, 2.25, 3.25], equal_nan=True)


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(
    lines=st.lists(st.sampled_from(["", " ", "\t"]) | st.integers(-99, 99).map(lambda x: f"{x}.5"), max_size=60),
    end=st.sampled_from(["\n", "\r\n", "\r"]),
    blocks=st.sampled_from([16, 64, 1 << 20]),
)
def test_every_line_between_the_first_and_the_last_number_of_one_column_is_a_sample(
    tmp_path, monkeypatch, lines, end, blocks
):
    lines = ["0.5", "1.5", *lines, *(["2.5"] * (len(lines) + 2))]  # fewer than half of them are blank
    path = tmp_path / "log.csv"
    path.write_bytes(end.join(["x", *lines, ""]).encode())
    monkeypatch.setattr("cdtool.formats.csv.text.BLOCK_BYTES", blocks)
    truth = [float(line) if line.strip() else np.nan for line in lines]
    for source in (Csv().columns(path), join_pieces(Csv().pieces(path), sort=False)):
        assert np.array_equal(source.columns["x"].values, truth, equal_nan=True)
        assert source.first_row == 2


# --- Footers

FOOTERS = {
    "a sum": ["Sum,7"],
    "a sum after a blank line": ["", "Sum,7"],
    "statistics": ["Sum,7", "Mean,1.5", "Max,4", "", "Std. dev.,0.3"],
    "words and numbers": ["Statistics", "\u03a3,7", "\u2211 a,7", "exported by hand"],
    "words that fill the row": ["End of file,"],
    "a ruler and a sum": ["---------", "Sum,7"],
    "a quoted sum": ['"Sum, all",7'],
    "a name for the sum of words": ["Sum,none"],
}


def written(lines: list[str], end: str = "\n", last: bool = True, encoding: str = "utf-8") -> bytes:
    return (end.join(["t,x", *lines]) + (end if last else "")).encode(encoding)


def check(source, count: int) -> None:
    np.testing.assert_array_equal(source.columns["t"].values, np.arange(count))
    np.testing.assert_array_equal(source.columns["x"].values, np.arange(count) + 0.5)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "utf-32"])
@pytest.mark.parametrize("last", [True, False], ids=["ended", "without a line end"])
@pytest.mark.parametrize("footer", FOOTERS.values(), ids=FOOTERS.keys())
def test_lines_of_words_and_numbers_below_the_rows_are_not_samples(log, footer, last, encoding):
    source = Csv().columns(log(written(ROWS + footer, last=last, encoding=encoding)))
    check(source, 9)
    (fact,) = of_kind(source, "footer_skipped")
    assert fact.numbers["text"] == next(line for line in footer if line.strip("-"))
    assert not with_severity(source, "loss")


MANY = [f"{i},{i}.5" for i in range(50_000)]  # more than the sample has


@pytest.mark.parametrize(
    ("rows", "footer", "lines", "encoding"),
    [
        (ROWS, ["", "Sum,7", "Mean,2"], (12, 13), "utf-8"),
        (MANY, ["Sum,7", "", "Mean,2"], (50002, 50004), "utf-8"),
        (MANY, ["Sum,7"], (50002,), "utf-16"),
    ],
    ids=["two lines", "after the sample", "after the sample in a wide encoding"],
)
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"], ids=["LF", "CRLF", "CR"])
def test_a_footer_is_reported_with_its_lines(log, machine, rows, footer, lines, encoding, end):
    path = log(written([*rows, *footer], end, encoding=encoding))
    source = Csv().columns(path)
    check(source, len(rows))
    fact = ("footer_skipped", {**lines_of(lines), "text": "Sum,7"})
    assert of_kind(source, "footer_skipped") == [fact]
    recording = read_recording(path, machine(SECONDS))
    assert of_kind(recording, "footer_skipped") == [fact] and len(recording["speed"]) == len(rows)


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("t,x\n" + "".join(f"2025-01-01 00:00:{i:02d},{i}.5\n" for i in range(12)) + "Sum,435\n", 14),
        ("".join(f"{i};{i},5;\n" for i in range(12)) + "Summe;72,0;\n", 13),
    ],
    ids=["below dates", "without a header, with trailing separators"],
)
def test_a_footer_is_detected_below_any_table(log, text, line):
    source = Csv().columns(log(text))
    assert list(source.columns.values())[1].values.tolist() == [i + 0.5 for i in range(12)]
    fact = ("footer_skipped", {**lines_of((line,)), "text": text.splitlines()[-1]})
    assert of_kind(source, "footer_skipped") == [fact]


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ([*ROWS, "ERR,1", "ERR,2"], "line 11, column 't': 'ERR' is not a number"),
        ([*ROWS[:4], "x,1", *ROWS[4:], "Sum,7"], "line 6, column 't': 'x' is not a number"),
        ([*ROWS[:4], "Sum,7", *ROWS[4:]], "line 6, column 't': 'Sum' is not a number"),
        ([*ROWS, "NA,1"], "line 11, column 't': 'NA' is not a number"),
        ([*ROWS, "OVL,1"], "line 11, column 't': 'OVL' is not a number"),
        ([*ROWS, "1O.5,1"], "line 11, column 't': '1O.5' is not a number"),
        ([*ROWS, *(f"state {i},1" for i in "abcdefghijklmnop")], "line 11, column 't': 'state a' is not a number"),
    ],
    ids=["repeated", "among the rows too", "among the rows", "not available", "overflow", "a slip", "many"],
)
def test_words_other_than_a_footer_are_an_error_with_a_machine_file(log, machine, lines, message):
    with pytest.raises(RecordingError, match=message):
        read_recording(log(written(lines)), machine(SECONDS))
    source = Csv().columns(log(written(lines)))
    assert of_kind(source, "footer_skipped") == [] and len(source.columns["x"].values) == len(lines)
    assert any("line" in str(finding) for finding in source.findings)  # the words are reported


@pytest.mark.parametrize(
    ("content", "kinds"),
    [
        (written([*ROWS, "t,x"]), ["header_lines"]),
        (written([*ROWS, "Sum,40.5", "9"], last=False), ["last_line_cut", "footer_skipped"]),
        (written([*ROWS, "End of file"]) + bytes(64), ["last_line_cut", "words_below_rows", "nul_bytes_at_end"]),
    ],
    ids=["a repeated header", "a total above a cut line", "a cut line below words"],
)
def test_what_is_beside_a_footer_is_no_sample_either(log, content, kinds):
    source = Csv().columns(log(content))
    check(source, 9)
    assert [finding.kind for finding in source.findings] == kinds
    assert [item.numbers["line"] for item in source.findings if item.kind == "last_line_cut"] in ([], [12])


def test_a_row_cut_by_a_power_failure_is_not_a_footer(log):
    source = Csv().columns(log(written([*ROWS, "Sum,7"]) + bytes(300)))
    assert of_kind(source, "footer_skipped") == []
    assert ("nul_bytes_at_end", {"count": 300}) in [fact_of(finding) for finding in source.findings]


def test_a_table_with_words_in_its_first_column_has_no_footer(log):
    source = Csv().columns(log(written(["up,1", "down,2", "up,3", "Sum,6"])))
    np.testing.assert_array_equal(source.columns["x"].values, [1.0, 2.0, 3.0, 6.0])
    assert of_kind(source, "footer_skipped") == []


@settings(max_examples=60, deadline=None)
@given(
    count=st.integers(13, 40),  # more rows than words, so that the column is numeric
    labels=st.lists(st.text("abcdefgijkmpqrtuvwxyz", min_size=2, max_size=9), min_size=1, max_size=12, unique=True),
    blank=st.integers(0, 3),
    last=st.booleans(),
    end=st.sampled_from(["\n", "\r\n", "\r"]),
)
def test_any_footer_and_nothing_else_is_removed(tmp_path_factory, count, labels, blank, last, end):
    path = tmp_path_factory.mktemp("footer") / "log.csv"
    footer = [f"{label.title()} of all,{i}" for i, label in enumerate(labels)]
    path.write_bytes(written([*MANY[:count], *[""] * blank, *footer], end, last))
    source = Csv().columns(path)
    check(source, count)
    assert len(of_kind(source, "footer_skipped")) == 1


def test_below_a_blank_line_a_footer_has_lines_of_any_width(log, machine):
    """Settings of an axis, as a French acquisition program writes them below its measurements."""
    table = "t;x;y;z\n" + "".join(f"{i};{i}.5;0;1\n" for i in range(30))
    below = "Paramètre;CoMax\nPID;KP;KI;KD\nPosition :;2420;8340\nSécurité\n"
    source = Csv().columns(log(table + "\n" + below))
    assert of_kind(source, "footer_skipped") == [
        ("footer_skipped", {**lines_of((33, 34, 35, 36)), "text": "Paramètre;CoMax"})
    ]
    assert len(source.columns["x"].values) == 30
    for text, line in ((table + below, 32), (table + "\n30;1.5\n", 33)):
        with pytest.raises(RecordingError, match=f"line {line} has 2 cells"):
            read_recording(log(text), machine(SECONDS))


# --- Several tables

PREAMBLE = ("Measurement of gate 7", "Operator: Jones", "Sample rate,1000", "Date;2024-03-01 12:00:00", "")
BETWEEN = ("", "\n", "Second table\n", "\n[channels]\n", "# next\n", "Result;ok\n\n")
TAILS = ("", "# end", "# end of the log", "\n", "% done\n", "// 12")


def random_table(rng: np.random.Generator, separator: str, width: int, rows: int, header: bool) -> str:
    names = ["t", *(f"{letter}{rng.integers(9)}" for letter in "abcdefghijklmnopqrstuvwxyz"[: width - 1])]
    numbers = [[0.01 * i, *row] for i, row in enumerate(rng.normal(0.0, 3.0, (rows, width - 1)), 1)]
    lines = [names] * header + [[f"{cell:.4f}" for cell in row] for row in numbers]
    return "".join(separator.join(line) + "\n" for line in lines)


def several(seed: int) -> tuple[str, int]:
    """Return a file of two or three tables, and its number of rows of numbers."""
    rng = np.random.default_rng(seed)
    text = "".join(f"{line}\n" for line in rng.choice(PREAMBLE, rng.integers(0, 4)))
    total, same = 0, bool(rng.integers(2))
    separator = str(rng.choice([",", ";", "\t"]))
    for number in range(int(rng.integers(2, 4))):
        rows = int(rng.choice([1, 2, 3, 12, 60, 700]))
        mark = separator if same else str(rng.choice([",", ";", "\t", " "]))
        text += str(rng.choice(BETWEEN)) if number else ""
        text += random_table(rng, mark, int(rng.integers(2, 7)), rows, bool(rng.integers(5)))
        total += rows
    return text + str(rng.choice(TAILS)), total


@pytest.mark.parametrize("seed", range(60))
def test_no_row_of_several_tables_is_dropped_without_a_loss(log, seed):
    text, total = several(seed)
    try:
        source = Csv().columns(log(text))
    except RecordingError as fault:
        assert "\n" not in str(fault)
        return
    read = max(len(column.values) for column in source.columns.values())
    assert read == total or with_severity(source, "loss")


def table(names: str, rows: int) -> str:
    width = names.count(",") + 1
    return f"{names}\n" + "".join(",".join(f"{0.01 * i + j:.2f}" for j in range(width)) + "\n" for i in range(rows))


TWO = table("t,a,b", 400) + table("t,a,b,c,d", 1600)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (TWO, r"lines 2 to 401 above the header in line 402 have numbers, but .*skip_lines = 401"),
        (table(",".join("abcdefghijklmnopqrstuvwx"), 700) + table("t,a", 4000), "have numbers|has 2 cells"),
        (
            "Gate 7\nOperator: Jones\n\n" + table("t,a,b", 400) + "\nSecond table\n" + table("t,a,b,c,d", 1600),
            "lines 5 to 404 above the header in line 407 have numbers",
        ),
        (table("t,a,b", 60) + table("t,a", 20).replace(",", ";"), "line 62"),
    ],
    ids=["wider below", "narrower below", "below a preamble", "another separator"],
)
def test_rows_of_another_table_are_refused_with_their_lines(log, text, message):
    with pytest.raises(RecordingError, match=message):
        Csv().columns(log(text))


@pytest.mark.parametrize(
    ("text", "pins", "lines"),
    [
        ("12,500\n" + table("t,a,b", 20), TablePins(), (1,)),
        (TWO, TablePins(header=402), tuple(range(2, 402))),
        (TWO, TablePins(skip_lines=401), ()),
    ],
    ids=["a single line", "above a pinned header", "skipped by a pin"],
)
def test_numbers_above_the_names_are_a_loss_unless_a_pin_skips_them(log, text, pins, lines):
    lost = with_severity(find_dialect(log(text), pins), "loss")
    assert [fact_of(item) for item in lost] == ([("numbers_above_rows", lines_of(lines))] if lines else [])


@pytest.mark.parametrize("tail", ["# end", "# end of the log, 12", "#"])
def test_a_last_comment_without_line_end_causes_no_loss_and_no_warning(log, tail):
    path = log("# log of gate 7\n" + table("t,a,b", 50) + tail)
    source = Csv().columns(path)
    assert len(source.columns["t"].values) == 50
    assert {finding.severity for finding in source.findings} == {"note"}
    run = PieceRun(Csv().pieces(path))
    assert sum(piece.rows for piece in run) == 50 and run.source.findings == source.findings


@pytest.mark.parametrize("below", ["s,Nm,m/s\nREAL,REAL,REAL\n", "REAL,REAL,REAL\ns,Nm,m/s\n"])
@pytest.mark.parametrize("header", [None, 1])
def test_a_row_of_types_above_or_below_the_units_is_not_the_names(log, below, header):
    names, rows = table("t,a,b", 50).split("\n", 1)
    dialect = find_dialect(log(f"{names}\n{below}{rows}"), TablePins(header=header))
    assert (dialect.names, dialect.units, dialect.first_line) == (("t", "a", "b"), ("s", "Nm", "m/s"), 4)
