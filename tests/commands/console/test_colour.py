"""Results on screen: colours where the environment wants them, and the table of a benchmark."""

from __future__ import annotations

import re
import shlex
import sys
from collections.abc import Mapping, Sequence
from dataclasses import replace

import pytest

from cdtool.commands.console.colour import Toned, shows_colour
from cdtool.commands.console.console import print_next, say, table
from cdtool.commands.console.summary_table import show_conclusion, show_table
from cdtool.results.evaluated import evaluate
from cdtool.results.results import ContactResult, ExposureResult, Results
from tests.report.html.html_case import case

RED = "\x1b[31m"


@pytest.fixture
def terminal(monkeypatch):
    """terminal(columns): from now on standard output is a terminal of that width."""
    for name in ("NO_COLOR", "FORCE_COLOR"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("TERM", "xterm-256color")

    def make(columns: int) -> None:
        monkeypatch.setattr(sys.stdout, "isatty", lambda: True, raising=False)
        monkeypatch.setenv("COLUMNS", str(columns))

    return make


def test_a_pipe_has_no_colour_unless_it_is_forced(monkeypatch, capsys):
    for name in ("NO_COLOR", "FORCE_COLOR"):
        monkeypatch.delenv(name, raising=False)
    say("violated", tone="bad")
    assert capsys.readouterr().out == "violated\n"
    monkeypatch.setenv("FORCE_COLOR", "1")
    say("violated", tone="bad")
    assert RED in capsys.readouterr().out
    monkeypatch.setenv("NO_COLOR", "1")
    assert not shows_colour(), "NO_COLOR takes precedence"


@pytest.mark.parametrize(("name", "value"), [("NO_COLOR", "1"), ("TERM", "dumb")])
def test_no_colour_is_shown_where_the_environment_does_not_want_it(terminal, monkeypatch, capsys, name, value):
    terminal(80)
    assert shows_colour()
    monkeypatch.setenv(name, value)
    say("violated", tone="bad")
    table([("missed", "right")], [[Toned(1, "bad")]])
    assert not re.search(r"\x1b\[[0-9;]*3[0-9]m", capsys.readouterr().out)


@pytest.mark.parametrize("columns", [60, 80, 120])
def test_a_table_fits_the_terminal_without_a_broken_word_or_trailing_blanks(terminal, monkeypatch, capsys, columns):
    terminal(columns)
    monkeypatch.setenv("NO_COLOR", "1")
    sentence = "Text exports: each channel has the times beside it, in s since the start of the export, with its unit."
    table([("name", "left"), ("description", "left")], [("twincat_scope", sentence), ("csv", "Text tables.")])
    table([("log", "left"), *[("range\nms", "right")] * 9], [("gate/stiff/03.csv", *["12.3 to 45.6"] * 9)])
    lines = capsys.readouterr().out.splitlines()
    assert all(line == line.rstrip() and len(line) <= columns for line in lines)
    assert max(map(len, lines)) > columns - 15, "the terminal is used"
    known = f"name description twincat_scope csv Text tables. log range ms gate/stiff/03.csv 12.3 to 45.6 {sentence}"
    assert {word for line in lines for word in line.split()} == set(known.split())


def test_two_long_names_of_a_row_are_folded_alike(terminal, monkeypatch, capsys):
    terminal(80)
    monkeypatch.setenv("NO_COLOR", "1")
    table([("group", "left"), ("detector", "left"), ("missed", "right")], [["g" * 60, "d" * 60, "0 of 4"]])
    lines = capsys.readouterr().out.splitlines()
    assert len(lines) == 3 and all(len(line) <= 80 for line in lines)


def test_the_command_to_run_next_fits_and_can_be_pasted(terminal, capsys):
    terminal(60)
    words = ["cdtool", "benchmark", "a folder/benchmark.toml", "-p", "protocol.toml", "-o", "reports/protocol.pdf"]
    print_next(*words)
    out = capsys.readouterr().out
    assert all(len(line) <= 60 for line in out.splitlines()) and "-p protocol.toml" in out
    assert shlex.split(out.removeprefix("next: ").replace("\\\n", "")) == words


def test_missed_contacts_and_false_alarms_are_red_and_not_assessable_ones_yellow(terminal, capsys):
    terminal(120)
    evaluated, _ = case()
    show_conclusion(evaluated)
    show_table(evaluated)
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith(RED) and "limits not met" in lines[0]
    assert all("limit violated" in line for line in lines if line.startswith((f"{RED}limit ", f"{RED}  limit ")))
    stiff = next(line for line in lines if line.startswith("stiff") and "slow" in line)
    assert f"{RED}\x1b[1m1 of 11\x1b" in stiff and "\x1b[33m\x1b[22m1 of 12\x1b" in stiff
    quick = next(line for line in lines if line.startswith("stiff") and "quick" in line)
    assert "\x1b" not in quick, "zeros have no colour"
    free = next(line for line in lines if line.startswith("hold-out") and "slow" in line)
    assert f"{RED}\x1b[1m1 in " in free


def test_colours_repeat_what_the_words_say(terminal, capsys, monkeypatch):
    terminal(120)
    evaluated, _ = case()

    def printed() -> str:
        show_conclusion(evaluated)
        show_table(evaluated)
        return capsys.readouterr().out

    coloured = re.sub(r"\x1b\[[0-9;]*m", "", printed())
    monkeypatch.setenv("NO_COLOR", "1")
    assert coloured == re.sub(r"\x1b\[[0-9;]*m", "", printed())


def shown(capsys: pytest.CaptureFixture[str], latencies: Mapping[str, Sequence[float | None]]) -> list[str]:
    base = ContactResult("", "stiff", "", "gate", 5.0, 0.001, 5.0, None, "missed", None, None, watched_ms=1000.0)
    rows = [
        replace(
            base, recording=f"{i}.csv", detector=name, latency_ms=late, outcome="missed" if late is None else "detected"
        )
        for name, values in latencies.items()
        for i, late in enumerate(values)
    ]
    exposure = tuple(ExposureResult("stiff", name, 4, 4, 0.5) for name in latencies)
    show_table(evaluate(Results({"onset": "x"}, tuple(latencies), ("stiff",), tuple(rows), (), exposure)))
    return [" ".join(line.split()) for line in capsys.readouterr().out.splitlines()]


def test_four_contacts_show_median_and_range_and_no_mean(capsys):
    lines = shown(capsys, {"momentum": [25.0, 27.0, 28.0, 28.5]})
    assert "stiff momentum 27.5 25.0 to 28.5 0 of 4 0 in 4" in lines
    assert not any("mean ms" in line or "P95 ms" in line for line in lines[:2])
    assert lines[-2].startswith("0 of 4 missed: up to 53 %")
    assert lines[-1] == "Fewer than 10 contacts detected: median and range, no mean, std or P95"


def test_without_a_note_no_empty_line_is_left(capsys):
    assert shown(capsys, {"momentum": [25.0 + i for i in range(60)]})[-1] == "0 of 60 missed: up to 4.9 % (95 %)"


def test_groups_without_a_miss_have_one_line_of_bounds_with_the_fewest_and_the_most_contacts(capsys):
    many = {name: [25.0] * count for name, count in (("momentum", 4), ("direct", 8), ("energy", 12))}
    (line,) = [line for line in shown(capsys, many) if "missed: up to" in line]
    assert line == "0 of 4 missed: up to 53 %; 0 of 12 missed: up to 22 % (95 %)"


def test_a_missed_contact_counts_as_later_than_the_range(capsys):
    lines = shown(capsys, {"momentum": [25.0, 27.0, 28.0, None], "direct": [None, None]})
    assert "stiff momentum 27.5 25.0 to not reached 1 of 4 0 in 4" in lines
    assert "stiff direct not reached not reached 2 of 2 0 in 4" in lines


def test_ten_contacts_show_the_mean_with_its_interval_next_to_a_small_group(capsys):
    lines = shown(capsys, {"momentum": [25.0 + i for i in range(10)], "direct": [25.0, 27.0]})
    many = next(line for line in lines if line.startswith("stiff momentum"))
    assert many.startswith("stiff momentum 29.5 (") and "25.0 to 34.0" in many
    assert "stiff direct - - 26.0 25.0 to 27.0 - 0 of 2 0 in 4" in lines
    alone = shown(capsys, {"momentum": [25.0 + i for i in range(10)]})
    assert not any("range" in line and "ms" in line for line in alone[:2])
    assert not any(line.startswith("Fewer than 10") for line in alone)
