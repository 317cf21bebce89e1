"""The dialect of a table by some of its rows is that by all of them."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.base.errors import RecordingError
from cdtool.formats.channels.channel_map import TablePins
from cdtool.formats.csv.encoding import detect_text
from cdtool.formats.csv.text import SAMPLE_BYTES
from cdtool.formats.csv_dialect import find_dialect as finding
from tests.formats.csv_cases import cases

HEADS = (
    "",
    "t,a,b,c\n",
    "t;a;b;c\n",
    "t\ta\tb\tc\n",
    "t|a|b|c\n",
    "time [s];torque [Nm];speed;position\n",
    "t,a,b,c\ns,Nm,rad/s,m\n",
    "# made by a bench\n# t,a,b,c\n",
    "Bench 7\nOperator: X\n\nt;a;b;c\n[s];[Nm];[-];[mm]\n",
    "sep=;\nt;a;b;c\n",
    "0,1,2,3\n",
    "1,2,3,4\n",
    "t,1,2,3\n",
    "t;a;b;c;\n",
    "-----+-----\nt,a,b,c\n-----+-----\n",
    "5;6;7;8\n9;1;2;3\nt;a;b;c\n",
    "t,a,b,c\n0.0,1,x,3\n0.1,nan,2,?\n",
)
INTEGER = st.integers(-2000, 2000).map(str)
POINT = st.floats(-1e4, 1e4, allow_nan=False).map(repr) | st.sampled_from(
    ["1.234", "999.125", "0.500", ".5", "5.", "+1.5"]
)
COMMA = st.floats(-1e3, 1e3).map(lambda value: f"{value:.3f}".replace(".", ",")) | st.sampled_from(["1,5", "1,234"])
RARE = st.sampled_from(
    ["", "nan", "NaN", "inf", "1e5", "1.5e-3", "1,5e3", "1.234.567", "x", "2.5.2020", '"1.5"', " 1.5", "1 234", "-"]
)
CELLS = {"integer": INTEGER, "point": POINT, "comma": COMMA, "empty": st.just("")}


@st.composite
def tables(draw):
    """A head, and up to 400 rows of columns of one kind each, in some of which other cells are strewn."""
    head = draw(st.sampled_from(HEADS))
    separator = draw(st.sampled_from([",", ";", "\t", "|", ", ", " "])) if not head else ""
    if not separator:
        separator = next((mark for mark in "\t;|," if mark in head), ",")
    written = draw(
        st.sampled_from([("integer", "point"), ("point", "empty"), ("integer", "comma", "empty"), tuple(CELLS)])
    )
    kinds = draw(st.lists(st.sampled_from(written), min_size=4, max_size=4))
    drawn = [draw(st.lists(CELLS[kind], min_size=1, max_size=7)) for kind in kinds]
    count = draw(st.sampled_from([99, 100, 130, 260, 400]))
    rows = [[cells[i % len(cells)] for cells in drawn] for i in range(count)]
    for _ in range(draw(st.sampled_from([0, 0, 1, 3]))):
        column, cell = draw(st.integers(0, 3)), draw(RARE)
        first = draw(st.integers(0, count - 1))
        for row in rows[first : first + draw(st.sampled_from([1, 3, 60]))]:
            row[column] = cell
    end = draw(st.sampled_from(["\n", "\r\n"]))
    lines = [*head.splitlines(), *(separator.join(row) for row in rows)]
    for _ in range(draw(st.sampled_from([0, 0, 0, 1]))):
        lines.insert(
            draw(st.integers(0, len(lines))), draw(st.sampled_from(["", "# a comment", "Sum;1", "End", "1,2"]))
        )
    return end.join(lines) + draw(st.sampled_from(["", end, end + end]))


PINS = st.sampled_from(
    [
        TablePins(),
        TablePins(separator=";"),
        TablePins(decimal=","),
        TablePins(decimal=".", thousands=","),
        TablePins(header=1),
        TablePins(header=False),
        TablePins(skip_lines=3),
        TablePins(comment="1"),
        TablePins(missing=("1", "-2000")),
    ]
)


def outcome(read):
    try:
        return read()
    except RecordingError as fault:
        return str(fault)


def by_all_rows(text, stream, pins):
    finding.refuse_long_line(text, stream)
    return finding._by_lines(text, stream, pins)


def assert_alike(path, content, pins=TablePins()):  # noqa: B008
    """Compare the dialect by some rows with that by all rows."""
    path.write_bytes(content)
    sample = content[:SAMPLE_BYTES]
    if not sample.strip():
        return
    try:
        text, stream = detect_text(path, sample, pins.encoding)
    except RecordingError:
        return
    expected = outcome(lambda: by_all_rows(text, stream, pins))
    assert outcome(lambda: finding._dialect(text, stream, pins)) == expected


@settings(max_examples=150)
@given(tables(), PINS)
def test_some_rows_show_the_dialect_of_all(tmp_path_factory, table, pins):
    assert_alike(tmp_path_factory.getbasetemp() / "table.csv", table.encode(), pins)


@pytest.mark.parametrize("case", cases(0), ids=lambda case: case.name)
def test_a_case_with_its_last_rows_repeated_has_the_same_dialect_by_some_rows(tmp_path, case):
    content = case.content
    lines = content.splitlines(keepends=True)
    if content.startswith((b"\xff\xfe", b"\xfe\xff")) or not lines or not lines[-1].endswith(b"\n"):
        pytest.skip("not of whole lines of single bytes")
    assert_alike(tmp_path / "table.csv", b"".join([*lines, *lines[-2:] * 80]))
