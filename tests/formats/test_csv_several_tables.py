"""Several tables in one file: every line of numbers is a sample or a counted loss, or the file is refused."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.base.errors import RecordingError
from cdtool.base.findings import lines_of
from cdtool.formats.channels.channel_map import TablePins
from cdtool.formats.csv import Csv
from cdtool.formats.csv_dialect.find_dialect import find_dialect
from cdtool.formats.pieces import PieceRun
from tests.base.findings.facts import fact_of

PREAMBLE = ("Measurement of gate 7", "Operator: Jones", "Sample rate,1000", "Date;2024-03-01 12:00:00", "")
BETWEEN = ("", "\n", "Second table\n", "\n[channels]\n", "# next\n", "Result;ok\n\n")
TAILS = ("", "# end", "# end of the log", "\n", "% done\n", "// 12")


def table(rng: np.random.Generator, separator: str, width: int, rows: int, header: bool) -> str:
    names = ["t", *(f"{letter}{rng.integers(9)}" for letter in "abcdefghijklmnopqrstuvwxyz"[: width - 1])]
    lines = [separator.join(names)] if header else []
    values = rng.normal(0.0, 3.0, (rows, width - 1))
    lines += [
        separator.join([f"{0.01 * i:.2f}", *(f"{value:.4f}" for value in row)]) for i, row in enumerate(values, 1)
    ]
    return "".join(f"{line}\n" for line in lines)


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
        text += table(rng, mark, int(rng.integers(2, 7)), rows, bool(rng.integers(5)))
        total += rows
    return text + str(rng.choice(TAILS)), total


@pytest.mark.parametrize("seed", range(60))
def test_no_row_of_several_tables_is_dropped_without_a_loss(tmp_path, seed):
    text, total = several(seed)
    path = tmp_path / "log.csv"
    path.write_text(text, newline="")
    try:
        source = Csv().columns(path)
    except RecordingError as fault:
        assert "\n" not in str(fault)
        return
    read = max(len(column.values) for column in source.columns.values())
    assert read == total or any(finding.severity == "loss" for finding in source.findings)


def log(tmp_path, text: str):
    path = tmp_path / "log.csv"
    path.write_text(text, newline="")
    return path


def rows(count: int, width: int, first: float = 0.0) -> str:
    return "".join(",".join(f"{first + 0.01 * i + j:.2f}" for j in range(width)) + "\n" for i in range(count))


def test_rows_above_a_second_header_of_another_width_are_refused_with_their_lines(tmp_path):
    path = log(tmp_path, "t,a,b\n" + rows(400, 3) + "t,a,b,c,d\n" + rows(1600, 5))
    with pytest.raises(RecordingError, match=r"lines 2 to 401 above the header in line 402 have numbers") as fault:
        Csv().columns(path)
    assert "skip_lines = 401" in fault.value.hint


def test_a_thousand_rows_of_24_columns_below_which_another_table_follows_are_refused(tmp_path):
    path = log(tmp_path, ",".join("abcdefghijklmnopqrstuvwx") + "\n" + rows(700, 24) + "t,a\n" + rows(4000, 2))
    with pytest.raises(RecordingError, match=r"have numbers|has 2 cells"):
        Csv().columns(path)


def test_a_text_preamble_above_two_tables_does_not_hide_the_rows_of_the_first(tmp_path):
    preamble = "Measurement of gate 7\nOperator: Jones\n\n"
    path = log(tmp_path, preamble + "t,a,b\n" + rows(400, 3) + "\nSecond table\nt,a,b,c,d\n" + rows(1600, 5))
    with pytest.raises(RecordingError, match=r"lines 5 to 404 above the header in line 407 have numbers"):
        Csv().columns(path)


def test_rows_below_with_another_separator_are_not_a_footer(tmp_path):
    path = log(tmp_path, "t,a,b\n" + rows(60, 3) + "t;a\n" + rows(20, 2).replace(",", ";"))
    with pytest.raises(RecordingError, match="line 62"):
        Csv().columns(path)


def test_a_single_line_of_numbers_above_the_names_is_a_loss(tmp_path):
    source = Csv().columns(log(tmp_path, "12,500\nt,a,b\n" + rows(20, 3)))
    lost = [fact_of(finding) for finding in source.findings if finding.severity == "loss"]
    assert lost == [("numbers_above_rows", lines_of((1,)))]


def test_lines_skipped_by_a_pin_are_not_a_loss(tmp_path):
    path = log(tmp_path, "t,a,b\n" + rows(400, 3) + "t,a,b,c,d\n" + rows(1600, 5))
    dialect = find_dialect(path, TablePins(skip_lines=401))
    assert dialect.first_line == 403 and not [finding for finding in dialect.findings if finding.severity == "loss"]


def test_rows_above_a_pinned_header_are_a_loss(tmp_path):
    path = log(tmp_path, "t,a,b\n" + rows(400, 3) + "t,a,b,c,d\n" + rows(1600, 5))
    dialect = find_dialect(path, TablePins(header=402))
    lost = [fact_of(finding) for finding in dialect.findings if finding.severity == "loss"]
    assert lost == [("numbers_above_rows", lines_of(tuple(range(2, 402))))]


@pytest.mark.parametrize("tail", ["# end", "# x", "# end of the log, 12", "#"])
def test_a_last_comment_without_line_end_causes_no_loss_and_no_warning(tmp_path, tail):
    path = log(tmp_path, "# log of gate 7\nt,a,b\n" + rows(50, 3) + tail)
    source = Csv().columns(path)
    assert len(source.columns["t"].values) == 50
    assert {finding.severity for finding in source.findings} == {"note"}
    run = PieceRun(Csv().pieces(path))
    assert sum(piece.rows for piece in run) == 50 and run.source.findings == source.findings


@pytest.mark.parametrize("below", ["s,Nm,m/s\nREAL,REAL,REAL\n", "REAL,REAL,REAL\ns,Nm,m/s\n"])
@pytest.mark.parametrize("header", [None, 1])
def test_a_row_of_types_above_or_below_the_units_is_not_the_names(tmp_path, below, header):
    path = log(tmp_path, "t,a,b\n" + below + rows(50, 3))
    dialect = find_dialect(path, TablePins(header=header))
    assert dialect.names == ("t", "a", "b")
    assert dialect.units == ("s", "Nm", "m/s")
    assert dialect.first_line == 4
