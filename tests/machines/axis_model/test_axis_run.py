"""A joint's channels on one clock: own clocks, gaps, missing samples."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import RecordingError
from cdtool.machines.axis_model.axis_run import axis_run
from cdtool.recordings.recording import Recording, Series


@dataclass(frozen=True)
class Log:
    """Torque 3 t, speed sin t, each on a clock of its own."""

    torque_time: FloatArray
    speed_time: FloatArray

    def recording(self) -> Recording:
        torque = Series(self.torque_time, 3.0 * self.torque_time, "N")
        speed = Series(self.speed_time, np.sin(self.speed_time), "m/s")
        return Recording("log", "log", ("axis",), {"torque": torque, "speed": speed})


def jittered(period: float, offset: float, count: int, seed: int) -> FloatArray:
    rng = np.random.default_rng(seed)
    return offset + period * (np.arange(count) + rng.uniform(-0.3, 0.3, count))


def test_channels_with_own_jittered_clocks_come_to_the_slower_one() -> None:
    run = axis_run(Log(jittered(1e-3, 0.2, 2000, 1), jittered(4e-3, 0.0, 500, 2)).recording())
    assert run.period == pytest.approx(4e-3, rel=0.1)
    assert run.start >= 0.19
    assert np.nanmax(np.abs(run.torque - 3.0 * run.time)) < 1e-9
    assert run.speed is not None
    assert np.nanmax(np.abs(run.speed - np.sin(run.time))) < 1e-5
    assert run.known("torque", "speed").mean() > 0.99


def test_nothing_is_interpolated_across_a_gap() -> None:
    clock = np.arange(1000) * 1e-3
    run = axis_run(Log(np.delete(clock, slice(300, 350)), clock).recording())
    lost = (np.arange(len(run)) >= 300) & (np.arange(len(run)) < 350)
    assert not run.known("torque")[lost].any()
    assert run.known("torque")[~lost].all()
    assert run.known("speed").all()


@pytest.mark.parametrize(
    ("channels", "message"),
    [
        (("speed",), "no torque"),
        (("torque",), "no speed or position"),
    ],
)
def test_the_missing_channel_is_named(channels: tuple[str, ...], message: str) -> None:
    clock = np.arange(100) * 1e-3
    whole = Log(clock, clock).recording()
    part = Recording("log", "log", ("axis",), {name: whole[name] for name in channels})
    with pytest.raises(RecordingError, match=message):
        axis_run(part)
