"""Progress bars: only on a terminal, removed at the end, without threads that keep processes from being forked."""

from __future__ import annotations

import sys
import threading
from time import sleep

import pytest

from cdtool.commands.console import streams
from cdtool.commands.console.console import progress
from cdtool.commands.convert.converting import convert
from cdtool.commands.convert.recovering import recover
from cdtool.execution.workers import Workers, in_order
from tests.commands.convert.bags import write_part
from tests.commands.convert.kinds import table


class Terminal:
    """A stderr that claims to be a terminal and records its output."""

    encoding = "utf-8"

    def __init__(self) -> None:
        self.text = ""

    def isatty(self) -> bool:
        return True

    def write(self, text: str) -> int:
        self.text += text
        return len(text)

    def flush(self) -> None:
        pass


def terminal(monkeypatch: pytest.MonkeyPatch) -> Terminal:
    """Replace stderr by a terminal; not a fixture, since pytest replaces stderr after fixtures."""
    made = Terminal()
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(sys, "stderr", made)
    return made


def test_without_a_terminal_there_is_at_most_a_line_per_minute(capsys, monkeypatch):
    clock = iter([0.0, 59.0, 61.0, 70.0, 122.0])
    monkeypatch.setattr(streams, "monotonic", lambda: next(clock))
    with progress("converting", pulses=True) as advance:
        assert advance is not None
        for done in range(1, 5):
            advance(done, 4)
    assert capsys.readouterr().err == "converting: 2 of 4\nconverting: 4 of 4\n"


def test_a_bar_appears_and_disappears_at_the_end(monkeypatch):
    stderr = terminal(monkeypatch)
    with progress("converting", pulses=True) as advance:
        sleep(0.3)
        assert advance is not None
        advance(3, 7)
        sleep(0.3)
    assert "converting" in stderr.text and "3/7" in stderr.text
    assert stderr.text.rstrip("\r\n").endswith("\x1b[2K")  # the line is cleared


def test_an_error_in_the_block_is_raised_and_removes_the_bar(monkeypatch):
    stderr = terminal(monkeypatch)
    with pytest.raises(ValueError, match="mine"), progress("converting", pulses=True):
        sleep(0.3)
        raise ValueError("mine")
    assert stderr.text.rstrip("\r\n").endswith("\x1b[2K")


def test_convert_counts_its_rows_and_recover_its_messages_up_to_all_of_them(tmp_path):
    log = table(tmp_path / "run.csv", rows=40_000)
    steps: list[tuple[int, int]] = []
    convert(log, tmp_path / "out.csv", progress=lambda done, total: steps.append((done, total)))
    assert steps == sorted(steps) and steps[-1] == (40_000, 40_000)
    steps.clear()
    part = write_part(tmp_path / "part.mcap", 0.0)
    recover(part, tmp_path / "out.mcap", progress=lambda done, total: steps.append((done, total)))
    assert steps[-1] == (192, 192)


def test_the_bar_starts_no_thread_that_would_keep_processes_from_being_forked(monkeypatch):
    stderr = terminal(monkeypatch)
    threads = set(threading.enumerate())
    with progress("benchmark") as advance:
        assert set(threading.enumerate()) <= threads, "other tests may have left threads, the bar adds none"
        assert list(in_order(abs, range(6), 6, Workers(2, progress=advance))) == list(range(6))
    assert "6/6" in stderr.text
