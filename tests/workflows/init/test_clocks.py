"""`cdtool init`: which of several clocks, and its unit where nothing states it."""

from __future__ import annotations

import numpy as np
import pytest

from tests.workflows.init.drafts import drafted_columns, stroke


@pytest.mark.parametrize("first", ["sendTimestamp", "timestamp"])
def test_a_clock_that_is_named_as_nothing_else_comes_first(tmp_path, first):
    run = stroke()
    stamps = {"sendTimestamp": run.time + 0.02, "timestamp": run.time}
    others = {name: values for name, values in stamps.items() if name != first}
    draft = drafted_columns(tmp_path, {first: stamps[first], **others, "pos [m]": run.travel, "vel [m/s]": run.speed})
    assert draft.channels["time"]["column"] == "timestamp"


@pytest.mark.parametrize(("jitter", "unit"), [(0.0, "ms"), (0.1, "s")])
def test_a_clock_that_jitters_is_not_that_of_a_fast_drive(tmp_path, jitter, unit):
    """Steps of 0.1: 10 kHz in ms, or 10 Hz in s, without a speed that would decide."""
    run, noise = stroke(), np.random.default_rng(5)
    time = np.cumsum(0.1 * (1.0 + jitter * noise.uniform(-1.0, 1.0, len(run.time))))
    draft = drafted_columns(tmp_path, {"time": time, "pos": run.travel})
    assert draft.channels["time"]["unit"] == unit and draft.checked("time")
