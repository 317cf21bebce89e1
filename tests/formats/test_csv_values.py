"""Every number has the bits of Python's float, and every text of a column of categories is kept."""

from __future__ import annotations

import csv
import io
import math

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from cdtool.base.errors import UsageError
from cdtool.formats.channels.channel_map import ChannelMap, ChannelSource, TimeSource
from cdtool.formats.csv import Csv, write_csv
from tests.data_folder import UR10E_LOGS


def read(path):
    return Csv().columns(path)


def test_written_columns_keep_their_format_and_read_back(tmp_path):
    path = tmp_path / "out.csv"
    columns = {"t": np.array([0.0, 1.0]), "a": np.array([0.123456, math.nan])}
    write_csv(path, columns, {"t": "%.0f", "a": "%.3f"})
    assert path.read_text() == "t,a\n0,0.123\n1,nan\n"
    assert read(path).columns["a"].values[0] == 0.123
    with pytest.raises(UsageError, match="lengths"):
        write_csv(path, {"a": np.zeros(2), "b": np.zeros(3)}, {})


@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@given(st.lists(st.floats(allow_infinity=False), min_size=1, max_size=30))
@example([5e-324, 1.7976931348623157e308, -0.0, 0.1, 2.2250738585072014e-308])
def test_any_written_number_is_read_back_exactly(tmp_path, numbers):
    path = tmp_path / "bits.csv"
    column = np.array(numbers)
    write_csv(path, {"a": column, "b": np.full(len(column), 0.5)}, {})  # 1.375 alone may be 1375
    assert np.array_equal(read(path).columns["a"].values, column, equal_nan=True)
    path.write_text("a;b\n" + "".join(f"{x!r};0.5\n".replace(".", ",") for x in numbers))
    assert np.array_equal(read(path).columns["a"].values, column, equal_nan=True)


@pytest.mark.parametrize(
    ("name", "rows", "width"), [("link4", 1896, 25), ("ur-static", 4259, 31), ("no_torque", 531, 31)]
)
def test_the_ur10e_files_without_header_are_read_completely(name, rows, width):
    path = UR10E_LOGS / f"{name}.csv.gz"
    source = read(path)
    assert len(source.columns) == width
    table = np.column_stack([column.values for column in source.columns.values()])
    assert np.array_equal(table, np.loadtxt(path, delimiter=","))
    assert len(table) == rows


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


@settings(max_examples=100)
@given(st.lists(st.tuples(CELL, CELL, CELL), min_size=20, max_size=60), st.sampled_from(["\n", "\r\n"]), st.booleans())
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


TEXTS = [
    "a",
    "b c",
    "run_A",
    "ü",
    "x'y",
    "7",
    "-0.5",
    "",
    "nan",
    "2024-05-01",
    'say "hi"',
    "semi;colon",
    "com,ma",
    "tab\there",
]


def wanted(column: str) -> ChannelMap:
    sources = tuple(ChannelSource(name, (name,)) for name in ("speed", "torque"))
    return ChannelMap(TimeSource("t", unit="s"), (*sources, ChannelSource("id", (column,), words=True)), ("axis",))


def ids(source, column: str) -> list[str | float]:
    column_read = source.columns[column]
    return [column_read.words.get(value, value) for value in column_read.values.tolist()]


@settings(max_examples=40)
@given(
    st.lists(st.sampled_from(TEXTS), min_size=12, max_size=40),
    st.sampled_from([",", ";", "\t"]),
    st.integers(0, 3),
    st.sampled_from([csv.QUOTE_MINIMAL, csv.QUOTE_NONNUMERIC]),
)
def test_texts_are_those_that_a_csv_reader_finds(tmp_path_factory, texts, separator, place, quoting):
    path = tmp_path_factory.mktemp("words") / "log.csv"
    names = ["t", "speed", "torque"]
    names.insert(place, "phase")
    lines = io.StringIO()
    writer = csv.writer(lines, delimiter=separator, quoting=quoting, lineterminator="\n")
    writer.writerow(names)
    for i, text in enumerate(texts):
        row: list[object] = [i / 100, i * 1.5, -i]
        row.insert(place, text)
        writer.writerow(row)
    path.write_text(lines.getvalue(), encoding="utf-8")
    source = Csv().columns(path, wanted("phase"))
    expected = [float(text) if text in ("7", "-0.5") else np.nan if text in ("", "nan") else text for text in texts]
    assert ids(source, "phase") == pytest.approx(expected, nan_ok=True)
    assert source.columns["torque"].values.tolist() == [-float(i) for i in range(len(texts))]


def test_a_text_has_the_same_code_in_every_block_of_a_long_table(tmp_path):
    count = 60_000
    words = [f"run {i // 20_000}" for i in range(count)]
    path = tmp_path / "log.csv"
    path.write_text("t,phase,speed,torque\n" + "".join(f"{i}e-3,{word},{i}.25,1\n" for i, word in enumerate(words)))
    source = Csv().columns(path, wanted("phase"))
    assert ids(source, "phase") == words and len(source.columns["phase"].words) == 3


def test_a_number_beside_words_stays_a_number_with_a_decimal_comma(tmp_path):
    path = tmp_path / "log.csv"
    path.write_text("t;phase;speed;torque\n" + "".join(f"0,{i:02d};{['1,5', 'x'][i % 2]};{i},5;1\n" for i in range(20)))
    assert ids(Csv().columns(path, wanted("phase")), "phase") == [1.5, "x"] * 10
