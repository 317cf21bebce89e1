"""Texts of a column of categories are read alike, whether pandas or the slow path reads their line."""

from __future__ import annotations

import csv
import io

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.formats.channels.channel_map import ChannelMap, ChannelSource, TimeSource
from cdtool.formats.csv import Csv

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
