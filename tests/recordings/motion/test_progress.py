"""Progress and fitting samples: the kernels compared with the same rules written for whole arrays."""

from __future__ import annotations

import numpy as np

from cdtool.recordings.motion.progress import progress
from cdtool.recordings.recording import Recording, Series


def test_it_is_computed_once_on_each_clock_of_the_recording():
    time = np.arange(100) * 1e-3
    channels = {"speed": Series(time, np.ones(100), "m/s"), "position": Series(time.copy(), time, "m")}
    recording = Recording("run", "", ("x",), channels)
    first = progress(recording, time.copy(), 1, 0.1, 0.9, 0)
    assert progress(recording, channels["position"].time, 1, 0.1, 0.9, 0) is first
    assert progress(recording, time, 1, 0.1, 0.8, 0) is not first
    assert progress(recording, time + 1e-4, 1, 0.1, 0.9, 0) is not first
    moved = {**channels, "position": Series(time, 2.0 * time, "m")}
    assert progress(Recording("run", "", ("x",), moved), time, 1, 0.1, 0.9, 0).travel[-1] == 2.0 * first.travel[-1]
