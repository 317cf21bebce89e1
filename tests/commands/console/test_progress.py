"""The progress bar of work that several processes do: it leaves them the quick start that they have without it."""

from __future__ import annotations

import threading

from cdtool.commands.console.console import progress
from cdtool.execution.workers import Workers, in_order
from tests.commands.console.test_pulsing_bar import terminal


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


def test_the_bar_starts_no_thread_that_would_keep_processes_from_being_forked(monkeypatch):
    stderr = terminal(monkeypatch)
    threads = set(threading.enumerate())
    with progress("benchmark") as advance:
        assert set(threading.enumerate()) <= threads, "other tests may have left threads, the bar adds none"
        assert list(in_order(abs, range(6), 6, Workers(2, progress=advance))) == list(range(6))
    assert "6/6" in stderr.text
