"""`cdtool signature forecast` on a simulated season whose friction follows the temperature."""

from __future__ import annotations

import json
from datetime import date, timedelta
from pathlib import Path

import pytest

import cdtool as api
from tests.command import Outcome, cdtool

BUDGET = ("--false-alarm-budget", "1/20op")


@pytest.fixture(scope="module")
def season(tmp_path_factory) -> Path:
    """46 runs on 16 days; a signature of the momentum observer learned from the first 12."""
    folder = tmp_path_factory.mktemp("forecast") / "season"
    made = cdtool(
        *("simulate", "season", "--runs", 46, "--runs-per-day", 3, "--friction-per-kelvin", -0.015),
        *("--temperature", 12, "--temperature-swing", 8, "--start", "2025-09-01", "--seed", 2, "-o", folder),
    )
    assert made.status == 0 and "ambient.csv" in made.out, made.err
    learned = cdtool(
        "learn-signature", *logs(folder)[:12], "-m", folder / "machine.toml", "-d", "gm", "-o", stored(folder)
    )
    assert learned.status == 0, learned.err
    return folder


def logs(folder: Path) -> list[Path]:
    return sorted((folder / "free").iterdir())


def stored(folder: Path) -> Path:
    return folder / "gm.json"


def forecast(folder: Path, *options: object, given: list[Path] | None = None) -> Outcome:
    runs = logs(folder) if given is None else given
    return cdtool("signature", "forecast", stored(folder), *runs, "-m", folder / "machine.toml", *options)


def table(folder: Path) -> tuple[object, ...]:
    return ("--ambient", folder / "ambient.csv")


def test_the_forecast_states_share_budget_date_and_what_it_rests_on(season, tmp_path):
    plot = tmp_path / "forecast.png"
    done = forecast(season, *table(season), "--temperatures", "2:18", *BUDGET, "--plot", plot)
    assert done.status == 0, done.err
    text = " ".join(done.out.split())
    for words in (
        "false alarms expected in",
        "from 2.0 to 18.0 °C",
        "the budget of 5 % is",
        "relearn",
        "seen: 34 runs of 12 days",
        "the level changes with temperature by -",
        "not used: 12 runs that the signature was learned from",
    ):
        assert words in text, text
    assert plot.stat().st_size > 10_000


def test_json_has_the_curves_the_runs_and_the_dates(season):
    done = forecast(season, *table(season), "--until", "2025-09-25", *BUDGET, "--json")
    assert done.status == 0, done.err
    values = json.loads(done.out)
    (found,) = values["classes"]
    assert values["false_alarm_budget"] == "1/20op" and found["budget"] == 0.05
    assert len(found["runs"]) == 34 and values["runs_learned_from"] == 12
    assert found["forecast_until"] == "2025-09-25" and found["beyond"] == 0.0
    assert found["share"]["low"] <= found["share"]["value"] <= found["share"]["high"]
    assert len(found["by_temperature"]["at"]) == len(found["by_temperature"]["share"])


def test_the_python_function_returns_the_same_as_the_command(season):
    done = forecast(season, *table(season), *BUDGET, "--json")
    found = api.forecast_signature(
        stored(season),
        logs(season),
        season / "machine.toml",
        ambient=season / "ambient.csv",
        false_alarm_budget="1/20op",
    )
    share = json.loads(done.out)["classes"][0]["share"]
    assert found.classes[0].share.value == share["value"] and found.classes[0].share.high == share["high"]


def test_expected_temperatures_are_read_from_a_table(season, tmp_path):
    rows = "".join(f"2025-09-{day},{26 - day}\n" for day in range(10, 27))
    expected = tmp_path / "expected.csv"
    expected.write_text(f"date,temperature_c\n{rows}", encoding="utf-8")
    done = forecast(season, *table(season), "--expected", expected, *BUDGET, "--json")
    assert done.status == 0, done.err
    (found,) = json.loads(done.out)["classes"]
    assert found["coming_temperatures"] == [0.0, 9.0] and found["forecast_until"] == "2025-09-26"


def test_without_a_table_the_drift_over_the_runs_is_forecast(season):
    done = forecast(season, "--until", 20, *BUDGET)
    assert done.status == 0, done.err
    assert "temperature is not known: only the drift is forecast" in done.out and "spreads per run" in done.out


def test_logs_without_a_row_or_a_temperature_are_left_out_by_name(season, tmp_path):
    lines = (season / "ambient.csv").read_text(encoding="utf-8").splitlines()
    lines[20] = lines[20].rpartition(",")[0] + ","
    del lines[30]
    text = "\n".join(line.replace("free/", f"{season}/free/") for line in lines)
    path = tmp_path / "ambient.csv"
    path.write_text(text.replace(f"{season}/free/", ""), encoding="utf-8")
    done = forecast(season, "--ambient", path, *BUDGET)
    assert done.status == 3
    assert "20.csv: no temperature in" in done.err and "30.csv: no row in" in done.err
    assert "seen: 32 runs" in done.out


def test_no_temperature_at_all_leaves_the_drift_over_the_dates(season, tmp_path):
    lines = (season / "ambient.csv").read_text(encoding="utf-8").replace("free/", "").splitlines()
    path = tmp_path / "ambient.csv"
    path.write_text("\n".join(line.rpartition(",")[0] for line in lines), encoding="utf-8")
    done = forecast(season, "--ambient", path, *BUDGET)
    assert done.status == 0 and "spreads per day" in done.out, done.err
    refused = forecast(season, "--ambient", path, "--temperatures", "0:5", *BUDGET)
    assert refused.status == 2 and "no log has a temperature" in refused.err


@pytest.mark.parametrize(
    ("dates", "until", "said"),
    [
        (("2025-12-01", "2025-12-09"), (), "days after the last run (add the days between the two)"),
        ((), ("--until", "2025-12-24"), "ends before --until 2025-12-24 (add days, or omit --until)"),
    ],
)
def test_expected_temperatures_that_do_not_cover_the_coming_time_are_refused(season, tmp_path, dates, until, said):
    """Alarms of the time that is missing would be counted at the temperatures of another one."""
    rows = (season / "ambient.csv").read_text(encoding="utf-8").splitlines()
    last = date.fromisoformat(rows[-1].split(",")[1][:10])
    days = dates or tuple((last + timedelta(days=number)).isoformat() for number in (1, 2, 3))
    path = tmp_path / "expected.csv"
    path.write_text("date,temperature_c\n" + "".join(f"{day},15.0\n" for day in days), encoding="utf-8")
    done = forecast(season, "--ambient", season / "ambient.csv", "--expected", path, *until, *BUDGET)
    assert done.status == 2 and said in done.err, done.err


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ((), "states no false-alarm budget (give --false-alarm-budget, as 1/100op)"),
        (("--false-alarm-budget", "1/8h"), "false-alarm budget is 1/8h"),
        ((*BUDGET, "--temperatures", "0:5"), "add --ambient"),
        ((*BUDGET, "TABLE", "--temperatures", "5:0"), "temperatures are 5 to 0"),
        ((*BUDGET, "TABLE", "--temperatures", "cold"), "--temperatures is 'cold'"),
        ((*BUDGET, "TABLE", "--temperatures", "-80:5"), "is too far outside"),
        ((*BUDGET, "TABLE", "--temperatures", "0:5", "--expected", "x.csv"), "give --temperatures or --expected"),
        ((*BUDGET, "TABLE", "--until", "soon"), "--until is 'soon'"),
        ((*BUDGET, "TABLE", "--until", "2025-09-01"), "give a day after the last run"),
        ((*BUDGET, "TABLE", "--until", "2027-09-01"), "the forecast ends"),
        ((*BUDGET, "--until", "2025-12-01"), "the runs have no dates"),
        ((*BUDGET, "--ambient", "absent.csv"), "absent.csv"),
    ],
)
def test_what_makes_no_sense_is_refused_in_one_line(season, options, said):
    given = [word for option in options for word in (table(season) if option == "TABLE" else (option,))]
    done = forecast(season, *given)
    assert done.status == 2 and said in done.err, done.err
    assert len(done.err.splitlines()) == 1


def test_too_few_runs_are_refused(season):
    done = forecast(season, *table(season), *BUDGET, given=logs(season)[:20])
    assert done.status == 2 and "8 runs to forecast from (at least 30 are required" in done.err
