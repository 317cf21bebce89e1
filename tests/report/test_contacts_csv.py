"""Contacts and forces as CSV: the digits of a measurement, and nothing that a spreadsheet or terminal would run."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from cdtool.report.writers.contacts import contacts_lines
from cdtool.report.writers.forces import forces_lines
from cdtool.results.results import ForceResult, ForceStepResult, Results
from tests.command import cdtool
from tests.report.bench import contact
from tests.report.hostile import HOSTILE

ROOT = Path(__file__).parents[2]
RUN = ("=", "+", "-", "@", "＝", "＋", "－", "＠")


def contacts_csv(results: Results) -> str:
    return "".join(contacts_lines(results))


def forces_csv(results: Results) -> str:
    return "".join(forces_lines(results))


def read(text: str, delimiter: str = ",") -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(text, newline=""), delimiter=delimiter))


def test_the_csv_holds_every_contact(results):
    low = replace(contact("momentum", "stiff", -0.5), onset_s=-1.25, clipped=True, peak_force_n=math.nan)
    found = read(contacts_csv(replace(results, contacts=(*results.contacts, low))))
    assert len(found) == len(results.contacts) + 1
    assert found[0]["latency_ms"] == "30.0"
    assert found[0]["clipped"] == "false"
    assert found[0]["force_at_alarm_n"] == ""
    assert (found[-1]["onset_s"], found[-1]["latency_ms"], found[-1]["clipped"]) == ("-1.25", "-0.5", "true")
    assert found[-1]["peak_force_n"] == ""


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (60.00000000000006, "60.0"),
        (932.9999999999998, "933.0"),
        (0.0005000000000000004, "0.0005"),
        (1700000000.1234567, "1700000000.1234567"),
        (-1.25e-9, "-1.25e-09"),
        (1e300, "1e+300"),
    ],
)
def test_digits_that_arithmetic_left_behind_are_not_written(results, value, text):
    late = replace(contact("momentum", "stiff", 1.0), onset_s=value)
    (found,) = read(contacts_csv(replace(results, contacts=(late,))))
    assert found["onset_s"] == text and float(text) == pytest.approx(value, rel=1e-12)


def test_a_decimal_comma_is_read_back_and_stays_with_the_results(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    asked = ("score", ROOT / "docs/examples/triggers.csv", "-b", ROOT / "sample_logs/gate/benchmark.toml")
    points, commas = ("-o", "points.csv"), ("--set", "report.decimal=comma", "-o", "commas.csv", "-o", "results.json")
    for _ in range(2):  # the second time it replaces its own files
        assert {cdtool(*asked, *more).status for more in (points, commas)} == {1}
    assert cdtool("report", "results.json", "-o", "again.csv").status == 1
    written = Path("commas.csv").read_bytes()
    assert written.startswith(b"\xef\xbb\xbfrecording;group;") and written == Path("again.csv").read_bytes()
    german = pd.read_csv("commas.csv", sep=";", decimal=",")
    pd.testing.assert_frame_equal(german, pd.read_csv("points.csv"))
    assert german.onset_s.dtype == "float64" and german.onset_s.notna().all()


@pytest.mark.parametrize("name", ["gap; wide", *HOSTILE.values()])
def test_forces_with_a_decimal_comma_are_read_back(results, name):
    plain = with_forces(results, name)
    assert [row["step_at_most_n"] for row in read(forces_csv(plain))] == ["400.0", "150.0"]
    text = forces_csv(replace(plain, provenance={"report": {"decimal": "comma"}}))
    german = pd.read_csv(io.StringIO(text.removeprefix("\ufeff")), sep=";", decimal=",")
    pd.testing.assert_frame_equal(german, pd.read_csv(io.StringIO(forces_csv(plain))))


@pytest.mark.parametrize("start", [*RUN, " =", "\t=", "\r=", "\n="])
def test_a_spreadsheet_runs_no_cell(results, start):
    text = f'{start}cmd|"/c calc"!A1'
    (found,) = read(contacts_csv(replace(results, contacts=(contact(text, text, 1.0, name=text),))))
    shown = text.replace("\t", "?").replace("\r", "?").replace("\n", "?")
    expected = shown if shown.startswith("?") else shown.replace(start.strip(), f"'{start.strip()}", 1)
    assert [found[key] for key in ("recording", "group", "detector")] == [expected] * 3
    assert found["outcome"] == "detected"


@pytest.mark.parametrize("start", RUN)
def test_a_spreadsheet_that_splits_at_semicolons_runs_no_cell_either(results, start):
    text = f"a; {start}cmd|' /c calc'!A1;{start}1"
    body = contacts_csv(replace(results, contacts=(contact(text, text, 1.0, name=text),)))
    cells = [cell for row in csv.reader(io.StringIO(body), delimiter=";") for cell in row]
    assert len(cells) > 6
    assert not any(cell.lstrip().startswith(RUN) for cell in cells)


def test_a_file_with_decimal_commas_runs_no_cell_where_commas_separate(results):
    text = "a,=1+1"
    german = replace(
        results, contacts=(contact(text, text, 1.0, name=text),), provenance={"report": {"decimal": "comma"}}
    )
    cells = [cell for row in csv.reader(io.StringIO(contacts_csv(german))) for cell in row]
    assert not any(cell.startswith("=") for cell in cells)


@pytest.mark.parametrize("kind", HOSTILE)
def test_hostile_names_stay_in_their_cell_and_control_nothing(results, kind):
    name = HOSTILE[kind]
    text = contacts_csv(replace(results, contacts=(contact(name, name, 1.0, name=name),)))
    assert len(text.splitlines()) == 2
    assert not any(ord(letter) < 32 and letter != "\n" for letter in text)
    assert not set("\u202e\u2067\x7f\x9b") & set(text)
    (found,) = read(text)
    assert found["recording"] == found["group"] == found["detector"]
    assert found["latency_ms"] == "1.0"


def with_forces(results: Results, name: str) -> Results:
    steps = (
        ForceStepResult(name, 0.0, 400.0, 500.0, 12.0, "fail", name),
        ForceStepResult("static", 0.75, 150.0, None, None, "not_assessable", "the record ends"),
    )
    return replace(results, forces=(ForceResult(name, name, 1, name, "fail", 500.0, steps, name, 12.0, name),))


def test_forces_have_a_row_for_each_contact_and_step(results):
    first, second = read(forces_csv(with_forces(results, "gap")))
    assert (first["recording"], first["verdict"], first["peak_n"], first["point"]) == ("gap", "fail", "500.0", "gap")
    assert (first["step"], first["step_at_most_n"], first["step_time_budget_ms"]) == ("gap", "400.0", "12.0")
    assert (second["step"], second["step_peak_n"], second["step_time_budget_ms"]) == ("static", "", "")
    assert (second["step_verdict"], second["step_reason"]) == ("not_assessable", "the record ends")
