"""A line of sums below the rows is not a sample: it is left out and reported. Other words are still an error."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.base.errors import RecordingError
from cdtool.base.findings import Finding, lines_of
from cdtool.formats.channels.reading import read_recording
from cdtool.formats.csv import Csv
from tests.base.findings.facts import fact_of

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
ENDS = {"LF": "\n", "CRLF": "\r\n", "CR": "\r"}


def rows(count: int) -> list[str]:
    return [f"{i},{2 * i}.5" for i in range(count)]


def written(lines: list[str], end: str = "\n", last: bool = True, encoding: str = "utf-8") -> bytes:
    return (end.join(["t,a", *lines]) + (end if last else "")).encode(encoding)


def footers_of(source) -> list[tuple]:
    return [fact_of(finding) for finding in source.findings if finding.kind == "footer_skipped"]


def check(source, count: int) -> None:
    np.testing.assert_array_equal(source.columns["t"].values, np.arange(count))
    np.testing.assert_array_equal(source.columns["a"].values, 2.0 * np.arange(count) + 0.5)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16", "utf-32"])
@pytest.mark.parametrize("last", [True, False], ids=["ended", "without a line end"])
@pytest.mark.parametrize("footer", FOOTERS.values(), ids=FOOTERS.keys())
def test_lines_of_words_and_numbers_below_the_rows_are_not_samples(log, footer, last, encoding):
    source = Csv().columns(log(written(rows(9) + footer, last=last, encoding=encoding)))
    check(source, 9)
    (fact,) = footers_of(source)
    first = next(line for line in footer if line.strip("-"))
    assert fact.numbers["text"] == first
    assert not [finding for finding in source.findings if finding.severity == "loss"]


@pytest.mark.parametrize("end", ENDS.values(), ids=ENDS.keys())
@pytest.mark.parametrize(
    ("count", "footer", "lines"),
    [
        (3, ["Sum,7"], (5,)),
        (3, ["", "Sum,7", "Mean,2"], (6, 7)),
        (50_000, ["Sum,7", "", "Mean,2"], (50002, 50004)),
    ],
    ids=["short", "two lines", "longer than the sample"],
)
def test_a_footer_is_reported_with_its_lines(log, end, count, footer, lines):
    source = Csv().columns(log(written(rows(count) + footer, end)))
    check(source, count)
    assert footers_of(source) == [("footer_skipped", {**lines_of(lines), "text": "Sum,7"})]


def test_a_footer_in_a_wide_encoding_after_the_sample_is_detected(log):
    source = Csv().columns(log(written([*rows(50_000), "Sum,7"], encoding="utf-16")))
    check(source, 50_000)
    assert footers_of(source) == [("footer_skipped", {**lines_of((50002,)), "text": "Sum,7"})]


@pytest.mark.parametrize("clock", ['column = "t", unit = "ms"', 'column = "t", unit = "s"'])
def test_a_footer_is_also_left_out_with_a_machine_file(log, machine, clock):
    lines = "t,i_motor,n_motor\n" + "".join(f"{10 * i},{i},{i + 1}\n" for i in range(20))
    channels = (
        f'[channels]\ntime = {{ {clock} }}\nspeed = {{ column = "n_motor", unit = "rad/s" }}\n'
        'torque = { column = "i_motor", unit = "A", scale = 0.5 }\n'
    )
    plain = read_recording(log(lines, "plain.csv"), machine(channels))
    found = read_recording(log(lines + "Sum,190,210\n"), machine(channels))
    for channel in plain.channels:
        np.testing.assert_array_equal(found[channel].values, plain[channel].values)
    assert footers_of(found) == [("footer_skipped", {**lines_of((22,)), "text": "Sum,190,210"})]


def test_dates_above_a_footer_are_recognised(log):
    lines = [f"2025-01-01 00:00:{i:02d},{i}" for i in range(30)]
    source = Csv().columns(log(written([*lines, "Sum,435"])))
    np.testing.assert_array_equal(source.columns["t"].values, np.arange(30.0))
    assert footers_of(source) == [("footer_skipped", {**lines_of((32,)), "text": "Sum,435"})]


def test_a_footer_is_detected_without_a_header_and_with_trailing_separators(log):
    source = Csv().columns(log("".join(f"{i};{i},5;\n" for i in range(12)) + "Summe;72,0;\n"))
    np.testing.assert_array_equal(source.columns["1"].values, np.arange(12) + 0.5)
    assert footers_of(source) == [("footer_skipped", {**lines_of((13,)), "text": "Summe;72,0;"})]


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        ([*rows(9), "ERR,1", "ERR,2"], "line 11, column 't': 'ERR' is not a number"),
        ([*rows(4), "x,1", *rows(4), "Sum,7"], "line 6, column 't': 'x' is not a number"),
        ([*rows(4), "Sum,7", *rows(4)], "line 6, column 't': 'Sum' is not a number"),
        ([*rows(9), "NA,1"], "line 11, column 't': 'NA' is not a number"),
        ([*rows(9), "OVL,1"], "line 11, column 't': 'OVL' is not a number"),
        ([*rows(9), "1O.5,1"], "line 11, column 't': '1O.5' is not a number"),
        ([*rows(9), *(f"state {i},1" for i in "abcdefghijklmnop")], "line 11, column 't': 'state a' is not a number"),
    ],
    ids=["repeated", "among the rows too", "among the rows", "not available", "overflow", "a slip", "many"],
)
def test_words_other_than_a_footer_are_an_error_with_a_machine_file(log, machine, lines, message):
    channels = '[channels]\ntime = { column = "t", unit = "s" }\nspeed = { column = "a", unit = "rad/s" }\n'
    with pytest.raises(RecordingError) as fault:
        read_recording(log(written(lines)), machine(channels))
    assert message in fault.value.message
    source = Csv().columns(log(written(lines)))
    assert footers_of(source) == [] and len(source.columns["a"].values) == len(lines)
    assert any("line" in str(finding) for finding in source.findings)  # the words are reported


def test_a_row_cut_by_a_power_failure_is_not_a_footer(log):
    source = Csv().columns(log(written([*rows(9), "Sum,7"]) + bytes(300)))
    assert footers_of(source) == []
    assert any(fact_of(finding) == ("nul_bytes_at_end", {"count": 300}) for finding in source.findings)


def test_a_repeated_header_at_the_end_is_not_a_footer(log):
    source = Csv().columns(log(written([*rows(9), "t,a"])))
    check(source, 9)
    assert source.findings == (Finding("header_lines", "", lines_of((11,))),)


def test_a_table_with_words_in_its_first_column_has_no_footer(log):
    source = Csv().columns(log(written(["up,1", "down,2", "up,3", "Sum,6"])))
    np.testing.assert_array_equal(source.columns["a"].values, [1.0, 2.0, 3.0, 6.0])
    assert footers_of(source) == []


@settings(max_examples=60, deadline=None)
@given(
    count=st.integers(13, 40),  # more rows than words, so that the column is numeric
    labels=st.lists(st.text("abcdefgijkmpqrtuvwxyz", min_size=2, max_size=9), min_size=1, max_size=12, unique=True),
    blank=st.integers(0, 3),
    last=st.booleans(),
    end=st.sampled_from(sorted(ENDS.values())),
)
def test_any_footer_and_nothing_else_is_removed(tmp_path_factory, count, labels, blank, last, end):
    path = tmp_path_factory.mktemp("footer") / "log.csv"
    footer = [f"{label.title()} of all,{i}" for i, label in enumerate(labels)]
    path.write_bytes(written(rows(count) + [""] * blank + footer, end, last))
    source = Csv().columns(path)
    check(source, count)
    assert len(footers_of(source)) == 1


def test_below_a_blank_line_a_footer_has_lines_of_any_width(log, machine):
    """Settings of an axis, as a French acquisition program writes them below its measurements."""
    table = "t;x;y;z\n" + "".join(f"{i};{i}.5;0;1\n" for i in range(30))
    settings_below = "Paramètre;CoMax\nPID;KP;KI;KD\nPosition :;2420;8340\nSécurité\n"
    source = Csv().columns(log(table + "\n" + settings_below))
    assert footers_of(source) == [("footer_skipped", {**lines_of((33, 34, 35, 36)), "text": "Paramètre;CoMax"})]
    assert len(source.columns["x"].values) == 30
    channels = '[channels]\ntime = { column = "t", unit = "s" }\nspeed = { column = "x", unit = "rad/s" }\n'
    with pytest.raises(RecordingError, match="line 32 has 2 cells"):
        read_recording(log(table + settings_below), machine(channels))


def test_a_row_that_is_cut_off_below_a_blank_line_is_not_a_footer(log, machine):
    table = "t;x;y;z\n" + "".join(f"{i};{i}.5;0;1\n" for i in range(30)) + "\n30;1.5\n"
    channels = '[channels]\ntime = { column = "t", unit = "s" }\nspeed = { column = "x", unit = "rad/s" }\n'
    with pytest.raises(RecordingError, match="line 33 has 2 cells"):
        read_recording(log(table), machine(channels))


def test_a_total_above_a_line_that_is_cut_off_is_no_sample(log):
    source = Csv().columns(log("t;x\n" + "".join(f"{i};{i}.5\n" for i in range(9)) + "Sum;40.5\n9"))
    assert len(source.columns["x"].values) == 9
    assert [finding.kind for finding in source.findings] == ["last_line_cut", "footer_skipped"]


def test_a_line_that_is_cut_off_below_a_footer_has_its_own_number(log):
    source = Csv().columns(log("t;x\n" + "".join(f"{i};{i}.5\n" for i in range(9)) + "End of file\n" + "\0" * 64))
    cut = [finding.numbers for finding in source.findings if finding.kind == "last_line_cut"]
    assert cut == [{"line": 12}]
