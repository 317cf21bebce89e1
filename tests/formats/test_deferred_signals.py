"""Termination signals are handled between two calls of a library, and never in its callbacks."""

from __future__ import annotations

import signal
import threading

import numpy as np
import pytest

from cdtool.commands.convert.converting import convert
from cdtool.formats.containers import hdf5_writing
from cdtool.formats.containers.hdf5_writing import deferred_signals


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_is_deferred_to_its_delivery_or_the_end_of_the_context(number):
    def end(*_: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(number, end)
    try:
        reached = []
        with pytest.raises(KeyboardInterrupt), deferred_signals():
            signal.raise_signal(number)
            reached.append("after the signal")
        with pytest.raises(KeyboardInterrupt), deferred_signals() as deliver:
            signal.raise_signal(number)
            deliver()
            reached.append("after its delivery")
        assert reached == ["after the signal"]
        assert signal.getsignal(number) is end
    finally:
        signal.signal(number, before)


def test_an_ignored_signal_stays_ignored_and_another_thread_defers_none():
    before = signal.signal(signal.SIGTERM, signal.SIG_IGN)
    try:
        with deferred_signals() as deliver:
            signal.raise_signal(signal.SIGTERM)
            deliver()
        assert signal.getsignal(signal.SIGTERM) == signal.SIG_IGN
        seen = []

        def other_thread() -> None:
            with deferred_signals():
                seen.append(signal.getsignal(signal.SIGTERM))

        thread = threading.Thread(target=other_thread)
        thread.start()
        thread.join()
        assert seen == [signal.SIG_IGN]
    finally:
        signal.signal(signal.SIGTERM, before)


@pytest.mark.parametrize("call", [1, 5, 8])
def test_an_interruption_while_hdf5_writes_leaves_no_file(tmp_path, monkeypatch, call):
    pytest.importorskip("h5py")
    rows = "\n".join(f"{k * 0.001:.3f},{value}" for k, value in enumerate(np.sin(np.arange(500) / 50.0)))
    (tmp_path / "log.csv").write_text(f"time [s],torque [N m]\n{rows}\n", encoding="utf-8")
    write, calls = hdf5_writing._CheckedFile.write, []

    def interrupted(self: hdf5_writing._CheckedFile, data: object) -> int:
        calls.append(data)
        if len(calls) == call:
            signal.raise_signal(signal.SIGINT)
        return write(self, data)

    monkeypatch.setattr(hdf5_writing._CheckedFile, "write", interrupted)
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            convert(tmp_path / "log.csv", tmp_path / "log.h5")
    finally:
        signal.signal(signal.SIGINT, before)
    assert len(calls) >= call and not (tmp_path / "log.h5").exists()
