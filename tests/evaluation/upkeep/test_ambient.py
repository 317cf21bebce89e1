"""The tables of ambient temperatures: names of logs, dates, temperatures, and what is refused with its line."""

from __future__ import annotations

import math
from datetime import datetime
from pathlib import Path

import pytest

from cdtool.errors import ConfigurationError
from cdtool.evaluation.upkeep.ambient import read_ambient, read_expected

LOGS = ["free/01.csv", "free/02.csv", "later/03.csv"]
HEAD = "recording,date,temperature_c\n"


def written(folder: Path, text: str) -> Path:
    path = folder / "ambient.csv"
    path.write_text(text, encoding="utf-8")
    return path


def test_a_log_is_named_by_its_path_or_by_its_file_name(tmp_path):
    text = HEAD + "free/01.csv,2025-07-01T08:30,21.5\n03.csv,2025-07-03,\nother.csv,2025-07-02,1\n"
    found = read_ambient(written(tmp_path, text), LOGS)
    assert set(found) == {"free/01.csv", "later/03.csv"}
    assert found["free/01.csv"].when == datetime(2025, 7, 1, 8, 30) and found["free/01.csv"].temperature == 21.5
    assert math.isnan(found["later/03.csv"].temperature)


def test_the_column_of_temperatures_may_be_missing(tmp_path):
    found = read_ambient(written(tmp_path, "recording,date\n01.csv,2025-07-01\n"), LOGS)
    assert math.isnan(found["free/01.csv"].temperature)


def test_a_run_of_a_log_can_be_named(tmp_path):
    found = read_ambient(written(tmp_path, HEAD + "01.csv#7,2025-07-01,3\n"), LOGS)
    assert found["free/01.csv#7"].temperature == 3.0


def test_a_zone_is_converted_and_the_day_stays_as_written(tmp_path):
    found = read_ambient(written(tmp_path, HEAD + "01.csv,2025-07-01T00:30+02:00,3\n"), LOGS)["free/01.csv"]
    assert found.when == datetime(2025, 6, 30, 22, 30) and found.day.isoformat() == "2025-07-01"


@pytest.mark.parametrize(
    ("rows", "said"),
    [
        ("01.csv,1 July,3\n", "line 2: date is '1 July'"),
        ("01.csv,,3\n", "line 2: date is ''"),
        ("01.csv,9999-12-31T23:00-10:00,3\n", "line 2: date is '9999-12-31T23:00-10:00'"),
        ("01.csv,0001-01-01,3\n", "line 2: date is '0001-01-01'"),
        ("01.csv,2025-07-01,warm\n", "line 2: temperature_c is 'warm'"),
        ("01.csv,2025-07-01,nan\n", "line 2: temperature_c is 'nan'"),
        ("01.csv,2025-07-01,293.15\n", "line 2: temperature_c is 293.15"),
        ("01.csv,2025-07-01,3,5\n", "line 2: 4 cells under 3 columns"),
        ("01.csv,2025-07-01,3\n01.csv,2025-07-02,3\n", "line 3: '01.csv' is named again"),
        (
            "01.csv,2025-07-01,3\nfree/01.csv,2025-07-02,3\n",
            "line 3: 'free/01.csv' is free/01.csv, which is named before",
        ),
        ("01.csv,2025-07-01T08:00Z,3\n02.csv,2025-07-02,3\n", "line 3: date is '2025-07-02', without a zone"),
        ("09.csv,2025-07-01,3\n", "no row is of any log"),
        ("", "no row is of any log: it contains no row"),
    ],
)
def test_a_wrong_row_is_named_by_its_line(tmp_path, rows, said):
    with pytest.raises(ConfigurationError) as fault:
        read_ambient(written(tmp_path, HEAD + rows), LOGS)
    assert said in str(fault.value) and fault.value.hint


def test_expected_temperatures_are_put_in_order_of_time(tmp_path):
    path = written(tmp_path, "date,temperature_c\n2025-12-01,1\n2025-11-01T12:00,7\n")
    assert [item.temperature for item in read_expected(path)] == [7.0, 1.0]


def test_the_temperatures_of_another_year_can_be_expected(tmp_path):
    assert [item.temperature for item in read_expected(written(tmp_path, HEAD + "01.csv,2025-07-01,3\n"))] == [3.0]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("date,temperature_c\n", "contains no row"),
        ("date,temperature_c\n2025-12-01,\n", "line 2: temperature_c is empty"),
        ("date,temperature\n2025-12-01,3\n", "line 1: unknown column 'temperature'"),
        ("date\n2025-12-01\n", "line 1: column 'temperature_c' is missing"),
    ],
)
def test_a_wrong_table_of_expected_temperatures_is_named(tmp_path, text, said):
    with pytest.raises(ConfigurationError) as fault:
        read_expected(written(tmp_path, text))
    assert said in str(fault.value)
