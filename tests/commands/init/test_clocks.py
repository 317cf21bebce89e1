"""`cdtool init`: which of several clocks, and its unit where nothing states it."""

from __future__ import annotations

import numpy as np
import pytest

import cdtool
from tests.commands.init.drafts import drafted, drafted_columns, stroke


@pytest.mark.parametrize(("jitter", "unit"), [(0.0, "ms"), (0.1, "s")])
def test_a_clock_that_jitters_is_not_that_of_a_fast_drive(tmp_path, jitter, unit):
    """Steps of 0.1: 10 kHz in ms, or 10 Hz in s, without a speed that would decide."""
    run, noise = stroke(), np.random.default_rng(5)
    time = np.cumsum(0.1 * (1.0 + jitter * noise.uniform(-1.0, 1.0, len(run.time))))
    draft = drafted_columns(tmp_path, {"time": time, "pos": run.travel})
    assert draft.channels["time"]["unit"] == unit and draft.checked("time")


@pytest.mark.parametrize(
    ("whole", "rest"),
    [
        ("time_sec", "time_nsec"),
        ("sec", "nsec"),
        ("secs", "nsecs"),
        ("stamp_sec", "stamp_nanosec"),
        ("header.stamp.sec", "header.stamp.nanosec"),
        ("t_seconds", "t_nanoseconds"),
    ],
)
@pytest.mark.parametrize("since", [0.3, 1_764_380_000.3])
def test_seconds_and_nanoseconds_of_a_stamp_are_one_clock(tmp_path, whole, rest, since):
    """With a jittering clock: the nanoseconds alone start again 2 or 3 times in the log."""
    run = stroke()
    jitter = np.random.default_rng(2).uniform(-1e-4, 1e-4, len(run.time))
    parts = [divmod(int(1e9 * (step + 0.3)), 10**9) for step in run.time + jitter]
    columns = {
        whole: np.array([float(int(since) + part[0]) for part in parts]),
        rest: np.array([float(part[1]) for part in parts]),
        "pos [m]": run.travel,
        "vel [m/s]": run.speed,
    }
    log = tmp_path / "log.csv"
    np.savetxt(log, np.column_stack(list(columns.values())), "%.12g", ",", header=",".join(columns), comments="")
    draft = drafted(log, tmp_path)
    assert draft.channels["time"] == {"column": whole, "unit": "s", "nanoseconds": rest}
    recording = cdtool.read(log, tmp_path / "machine.toml")
    expected = run.time + jitter - (run.time + jitter)[0]
    assert recording["position"].time - recording["position"].time[0] == pytest.approx(expected, abs=2e-9)
