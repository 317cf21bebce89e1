"""Colours in the terminal: what is missed, violated or a false alarm; never where the environment says no."""

from __future__ import annotations

import re
import sys
from dataclasses import replace

import pytest

from cdtool.commands.console.colour import Toned, shows_colour
from cdtool.commands.console.console import say, table
from cdtool.commands.console.summary_table import show_conclusion, show_table
from tests.report.html.html_case import case

RED, YELLOW = "\x1b[31m", "\x1b[33m"


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


def test_missed_contacts_and_false_alarms_are_red_and_not_assessable_ones_yellow(terminal, capsys):
    terminal(120)
    evaluated, _ = case()
    show_conclusion(evaluated)
    show_table(evaluated)
    lines = capsys.readouterr().out.splitlines()
    assert lines[0].startswith(RED) and "limits not met" in lines[0]
    assert all("limit violated" in line for line in lines if line.startswith((f"{RED}limit ", f"{RED}  limit ")))
    stiff = next(line for line in lines if line.startswith("stiff") and "slow" in line)
    assert re.search("\x1b\\[1;31m +1\x1b", stiff) and re.search("\x1b\\[33m +1\x1b", stiff)
    quick = next(line for line in lines if line.startswith("stiff") and "quick" in line)
    assert "\x1b" not in quick, "zeros have no colour"
    free = next(line for line in lines if line.startswith("holdout") and "slow" in line)
    assert re.search("\x1b\\[1;31m +1\x1b", free)


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


@pytest.mark.parametrize("columns", [60, 80])
def test_detectors_have_short_names_where_the_table_is_too_wide(terminal, capsys, columns):
    terminal(columns)
    names = {"inertial_momentum_observer_of_all": "igm", "friction_ekf": "feekf"}
    evaluated, _ = case(
        lambda name: {"quick": "inertial_momentum_observer_of_all", "slow": "friction_ekf"}.get(name, name)
    )
    provenance = {**evaluated.results.provenance, "short_names": names}
    show_table(replace(evaluated, results=replace(evaluated.results, provenance=provenance)))
    lines = re.sub(r"\x1b\[[0-9;]*m", "", capsys.readouterr().out).splitlines()
    assert max(map(len, lines)) <= columns
    assert any(line.split()[:2] == ["stiff", "igm"] for line in lines)
    assert "igm: inertial_momentum_observer_of_all; feekf: friction_ekf" in " ".join(" ".join(lines).split())
    terminal(200)
    show_table(replace(evaluated, results=replace(evaluated.results, provenance=provenance)))
    out = capsys.readouterr().out
    assert "igm" not in out and "inertial_momentum_observer_of_all" in out
