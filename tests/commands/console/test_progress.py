"""The progress bar of work that several processes do: it leaves them the quick start that they have without it."""

from __future__ import annotations

import sys
import threading

import pytest

from cdtool.commands.console.console import progress
from cdtool.execution.workers import Workers, in_order
from tests.commands.console.test_late_progress import terminal

REMEMBERED: list[str] = []


def remembered(_: int) -> list[str]:
    return REMEMBERED


def test_the_bar_is_drawn_as_the_work_advances_and_removed_at_the_end(monkeypatch):
    stderr = terminal(monkeypatch)
    with progress("benchmark") as advance:
        assert advance is not None
        assert "benchmark" in stderr.text
        advance(3, 7)
        assert "3/7" in stderr.text
        for done in range(4, 8):
            advance(done, 7)
        assert "7/7" in stderr.text
        assert "5/7" not in stderr.text, "within a tenth of a second it is not drawn again"
    assert stderr.text.rstrip("\r\n").endswith("\x1b[2K")


@pytest.mark.skipif(sys.platform != "linux", reason="processes are forked on Linux only")
def test_processes_are_forked_on_a_terminal_too(monkeypatch):
    stderr = terminal(monkeypatch)
    threads = threading.active_count()
    with progress("benchmark") as advance:
        assert threading.active_count() == threads
        monkeypatch.setattr(sys.modules[__name__], "REMEMBERED", ["by a fork of this process"])
        seen = list(in_order(remembered, range(6), 6, Workers(2), progress=advance))
    assert seen == [["by a fork of this process"]] * 6
    assert "6/6" in stderr.text
