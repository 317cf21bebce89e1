"""No alarm out of a section that is not assessable: every detector with every threshold, on logs without comforts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import Detection, detect_operations
from cdtool.detectors import DETECTORS
from cdtool.detectors.detection import WHOLE_MACHINE, Alarm, Status
from cdtool.recordings.motion import motion_class
from cdtool.recordings.operations import Operation
from cdtool.recordings.recording import Recording, Series
from cdtool.thresholds import THRESHOLDS
from tests.contracts.prefixes import PERIOD, Combination, learned, log, machine_of, on_own_clocks

# Strokes of learned speeds and of others, which no class judges from so long on [s].
SPEEDS, GRACE = (0.3, 0.22, 0.22, -0.3, -0.45, -0.45, 0.15), 0.2
# At this share of the safety factor nearly every sample is outside: only a status keeps it from an alarm.
NARROW = 1e-3
# A held value is too old after 5 periods of its channel, which are at most 1.5 of PERIOD long here; and one more.
OLDEST = 6 * 1.5 * PERIOD


def hostile(item: Combination, rng: np.random.Generator) -> Recording:
    """A log with a contact, long bursts of NaN and long gaps in every channel, on jittering clocks of their own."""
    recording = on_own_clocks(log(machine_of(item.machine), SPEEDS, rng, contact_at=float(rng.uniform(0.5, 9.0))), rng)
    channels = {}
    for name, series in recording.channels.items():
        values, kept = series.values.copy(), np.ones(len(series), dtype=bool)
        for begin, end in rng.integers(0, len(values), 3)[:, np.newaxis] + [0, 1] * rng.integers(1, 200, (3, 1)):
            values[begin:end, rng.integers(values.shape[1])] = np.nan
        for begin, end in rng.integers(0, len(values), 2)[:, np.newaxis] + [0, 1] * rng.integers(1, 200, (2, 1)):
            kept[begin:end] = False
        channels[name] = Series(series.time[kept], values[kept], series.unit)
    return replace(recording, channels=channels)


def outside_before(found: Detection, alarm: Alarm) -> int:
    """How many samples up to an alarm were outside one after another; one that is missing is skipped, no other is."""
    statistic, band, j = found.statistic, found.band, alarm.column
    count = 0
    for k in range(int(np.searchsorted(statistic.time, alarm.time)), -1, -1):
        value = statistic.values[k, j]
        if statistic.valid[k, j] and (value > band.upper[k, j] or value < band.lower[k, j]):
            count += 1
        elif statistic.status[k, j] != Status.GAP:
            break
    return count


def oldest_input(item: Combination, recording: Recording, alarm: Alarm) -> float:
    """How long before an alarm the detector last had a value of each channel that it needs, of its joint [s]."""
    joints = [j for j, name in enumerate(recording.joints) if (alarm.joint,) in (WHOLE_MACHINE, (name,))]
    ages = []
    for channel in DETECTORS.load(item.detector).needs:
        series = recording[channel]
        known = series.time[np.isfinite(series.values[:, joints]).all(axis=1)]
        ages.append(alarm.time - known[known <= alarm.time].max(initial=-np.inf))
    return max(ages)


@pytest.mark.parametrize("threshold", THRESHOLDS.names(plugins=True))
@pytest.mark.parametrize("detector", DETECTORS.names(plugins=True))
def test_no_alarm_comes_out_of_a_section_that_is_not_assessable(detector, threshold):
    raised = 0
    for machine, how, debounce in (("axis", "motion", 7), ("arm", "whole", 1)):
        item = Combination(machine, True, detector, threshold)
        fitted = learned(item)
        narrow = tuple(one.with_safety_factor(NARROW * one.safety_factor) for one in fitted.thresholds)
        recording = hostile(item, np.random.default_rng([3, sum(map(ord, str(item)))]))
        operation = Operation(recording, motion_class(recording), 1, recording, how)
        activation = Activation(debounce, rearm=0.0)
        (found,) = detect_operations(
            [operation], machine_of(machine), DETECTORS.load(detector)(), narrow, activation, grace=GRACE
        )
        assert found.signal is not None and not found.statistic.valid.all()
        for alarm in {*found.verdict.alarms, *found.verdict.crossings}:
            k, j = int(np.searchsorted(found.statistic.time, alarm.time)), alarm.column
            assert found.statistic.valid[k, j] and found.signal.valid[k, j], f"{item} at {alarm.time:.3f} s"
            assert outside_before(found, alarm) >= debounce
            assert oldest_input(item, recording, alarm) < OLDEST
        raised += len(found.verdict.crossings)
    assert raised, "nothing was outside: the test would see nothing"
