"""Tables in terminals of 60 and 80 columns: names and numbers are not split, and every column is shown."""

from __future__ import annotations

import re
import sys

import pytest

from cdtool.base.errors import UsageError
from cdtool.commands.console.console import print_error, print_line, table

HEADINGS = [("group", "left"), ("detector", "left"), ("latency\nms", "right"), ("range\nms", "right"), ("why", "left")]
ROWS = [
    ("stiff", "inertial_momentum", "128.5", "30.0 to 34.0 / 30.0 to 34.0", "too few contacts could be assessed at all"),
    ("holdout", "kalman_momentum", "-", "-", ""),
]


@pytest.fixture
def terminal(monkeypatch, capsys):
    """terminal(columns): print the table in a terminal of that width; return its lines."""

    def shown(columns: int, rows=ROWS) -> list[str]:
        monkeypatch.setattr(sys.stdout, "isatty", lambda: True, raising=False)
        monkeypatch.setenv("COLUMNS", str(columns))
        table(HEADINGS, rows)
        return re.sub("\x1b\\[[0-9;]*m", "", capsys.readouterr().out).splitlines()

    return shown


@pytest.mark.parametrize("columns", [60, 80, 200])
def test_no_name_or_number_is_split_and_no_column_is_left_out(terminal, columns):
    lines = terminal(columns)
    assert max(map(len, lines)) <= columns
    text = "\n".join(lines)
    assert all(row[i] in text for row in ROWS for i in range(4))
    assert all(word in text.split() for word in ROWS[0][4].split())
    assert sum("inertial_momentum" in line for line in lines) == {60: 3, 80: 2, 200: 1}[columns]


def test_a_name_longer_than_the_terminal_is_folded_without_loss(terminal):
    name = "x" * 150
    lines = terminal(60, [("stiff", name, "1", "2", "")])
    assert sum(line.count("x") for line in lines) % 150 == 0 and max(map(len, lines)) <= 60


def test_a_line_wraps_at_words_in_a_terminal_and_stays_one_elsewhere(monkeypatch, capsys):
    path = f"/data/{'long_folder/' * 8}a-b.csv"
    fault = UsageError(f"{path}: {'no such file ' * 5}", "check the path")
    print_error(fault)
    whole = capsys.readouterr().err
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True, raising=False)
    monkeypatch.setenv("COLUMNS", "80")
    print_error(fault)
    print_line("  an indented line", err=True)
    *lines, last = capsys.readouterr().err.splitlines()
    assert whole.count("\n") == 1 and len(lines) > 2 and last == "  an indented line"
    assert max(len(line) for line in lines if path not in line) <= 80 and any(f"{path}:" in line for line in lines)
    assert " ".join(" ".join(lines).split()) == " ".join(whole.split()) and lines[1].startswith("  ")
