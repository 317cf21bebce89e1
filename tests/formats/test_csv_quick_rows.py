"""Every number has the bits of Python's float, in rows of plain numbers and beside other cells."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.base.errors import RecordingError
from cdtool.formats.csv import Csv
from cdtool.formats.csv.rows import RowReader, without_quotes
from cdtool.formats.exports.twincat_scope import TwincatScope
from tests.formats.scope_exports import Channel, Options, ramp, write_export

DIGITS = st.text("0123456789", max_size=10)
PLAIN = st.builds(
    "{}{}{}{}".format, st.sampled_from(["", "-", "+", "--"]), DIGITS, st.sampled_from(["", "."]), DIGITS
).filter(lambda cell: any(letter.isdigit() for letter in cell) and "--" not in cell)
CELL = (
    PLAIN
    | st.sampled_from(
        ["", "-0", "-0.0", "9007199254740992", "9007199254740993", "90071992.54740993", "99999999.99999999", "12345678"]
    )
    | st.sampled_from(["1e5", "-1.5E-300", "nan", "inf", "-inf", " 1.5", "1.5 ", "123456789.123456789", ".5", "5."])
    | st.floats(allow_nan=False).map(repr)
)


@settings(max_examples=300)
@given(st.lists(st.tuples(CELL, CELL, CELL), min_size=1, max_size=40), st.sampled_from(["\n", "\r\n"]), st.booleans())
def test_every_cell_has_the_bits_of_float(tmp_path_factory, rows, end, ended):
    path = tmp_path_factory.getbasetemp() / "quick.csv"
    first = ["0.25,1.5,-2.75,7.5"] * 30  # from which the dialect is clear
    lines = ["t,a,b,c", *first, *(f"0.25,{','.join(row)}" for row in rows), *first]
    path.write_bytes((end.join(lines) + end * ended).encode())
    columns = Csv().columns(path).columns
    for column, name in enumerate("abc"):
        values = columns[name].values[30 : 30 + len(rows)]
        expected = np.array([float(row[column]) if row[column].strip() else math.nan for row in rows])
        known = ~np.isnan(expected)
        assert values[known].tobytes() == expected[known].tobytes()
        assert np.isnan(values[~known]).all()


def test_columns_that_are_not_read_may_contain_words_and_quoted_separators(tmp_path):
    path = tmp_path / "words.csv"
    lines = [f'{i}.5,"a,{i}",word {i},{-i}' if i % 3 == 0 else f"{i}.5,b,word,{-i}" for i in range(200)]
    path.write_text("\n".join(["t,x,y,a", *lines, ""]))
    columns = Csv().columns(path).columns
    assert columns["t"].values.tolist() == [i + 0.5 for i in range(200)]
    assert columns["a"].values.tolist() == [-i for i in range(200)]


def test_a_file_of_one_block_has_the_columns_of_a_larger_file(tmp_path):
    text = "".join(f"{i}.25,{i * 7 % 1000}.125\n" for i in range(60_000))
    small, large = tmp_path / "small.csv", tmp_path / "large.csv"
    small.write_text("t,a\n" + text[: 1 << 19].rpartition("\n")[0] + "\n")
    large.write_text("t,a\n" + text * 2)
    assert small.stat().st_size < 1 << 20 < large.stat().st_size
    of_small, of_large = (Csv().columns(path).columns for path in (small, large))
    for name in "ta":
        count = len(of_small[name].values)
        assert count > 10_000
        assert of_small[name].values.tobytes() == of_large[name].values[:count].tobytes()


ODD = st.sampled_from(
    [
        *("1,2", "1,2,3,4", "1,2,3,4,5", "1,2,", ",2,3", "1,2,nan", "", "# 1,2,3", "t,a,b", "1,x,3", '1,"2",3'),
        *("1,2,3\r", "1,2,3\0"),
    ]
)


@settings(max_examples=200)
@given(st.lists(st.just("0.5,1.5,2.5") | ODD, max_size=12), st.sampled_from(["", "\n"]))
def test_rows_are_the_same_whether_or_not_their_lines_are_found(tmp_path_factory, rows, end):
    path = tmp_path_factory.getbasetemp() / "plain.csv"
    path.write_text("\n".join(["t,a,b", *["0.25,1.5,7.5"] * 20, *rows]) + end)

    def outcome():
        try:
            source = Csv().columns(path)
        except RecordingError as fault:
            return str(fault)
        values = {name: column.values.tobytes() for name, column in source.columns.items()}
        return values, [str(finding) for finding in source.findings], source.first_row

    with pytest.MonkeyPatch.context() as patch:
        found = outcome()
        patch.setattr(RowReader, "_plain", lambda *_: None)
        assert outcome() == found


def test_all_rows_of_a_block_may_end_before_the_last_clock(tmp_path, monkeypatch):
    monkeypatch.setattr("cdtool.formats.csv.text.BLOCK_BYTES", 512)
    channels = [Channel("a", "1", ramp(200)), Channel("b", "2", ramp(20))]
    columns = TwincatScope().columns(write_export(tmp_path / "run.csv", channels, Options(full_stamps=True))).columns
    assert [columns[channel.name].values.tolist() for channel in channels] == [channel.values for channel in channels]


@pytest.mark.parametrize(
    ("quoted", "plain"),
    [
        ('"1","2"\r\n"3",4\n', "1,2\r\n3,4\n"),
        ('"",1\n"2"', ",1\n2"),
        ('"1,5",2\n', None),
        ('1,"2\n3",4\n', None),
        ('5",6\n', None),
        ('"a""b",1\n', None),
        ('1,"2\n', None),
    ],
)
def test_quotes_are_left_out_where_each_is_the_border_of_a_cell(quoted, plain):
    assert without_quotes(quoted.encode(), b",") == (quoted if plain is None else plain).encode()


@pytest.mark.parametrize("odd", ["# a comment", "12,ERR,3", '"12","2.5",3', "", "t,a,b"])
def test_one_unusual_line_leaves_the_other_rows_as_they_are(tmp_path, odd):
    rows = [f"{i}.25,{i * 7 % 1000}.125,{-i}" for i in range(20_000)]
    usual, unusual = tmp_path / "usual.csv", tmp_path / "unusual.csv"
    usual.write_text("\n".join(["t,a,b", *rows, ""]))
    unusual.write_text("\n".join(["t,a,b", *rows[:12_000], odd, *rows[12_000:], ""]))
    expected, found = Csv().columns(usual).columns, Csv().columns(unusual).columns
    for name in "tab":
        values = found[name].values
        values = np.delete(values, 12_000) if len(values) > 20_000 else values
        assert values.tobytes() == expected[name].values.tobytes()
