"""One detection with all its limits moved: alarms and latencies as functions of the safety factor.

The points of the curve of latency against false alarms (activity monitor operating characteristic, AMOC).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cdtool.activation import Activation, begins_at
from cdtool.detection import Status
from cdtool.evaluation.sweep_kernel import count_alarms
from cdtool.evaluation.truth.matching import windows
from cdtool.pipeline import Detection
from cdtool.recording import Contact, FloatArray

# Multiples of the safety factor that is set: a quarter to four times, eight steps an octave.
MULTIPLES: FloatArray = 2.0 ** (np.arange(-16, 17) / 8.0)


@dataclass(frozen=True)
class Swept:
    """For each of f safety factors: alarms that belong to no contact (f,), and latencies (f, contacts) [s].

    A latency is NaN if the contact raised no alarm, or was in progress when the recording began.
    """

    false_alarms: npt.NDArray[np.int64]
    latency: FloatArray


def sweep(
    detection: Detection, contacts: Sequence[Contact], activation: Activation, window: float, factors: FloatArray
) -> Swept:
    """Return alarms and latencies of a detection for several safety factors.

    Parameters
    ----------
    detection : Detection
        An operation with its statistic and threshold.
    contacts : sequence of Contact
        The contacts of the operation.
    activation : Activation
        What raises an alarm.
    window : float
        How long after its onset a contact may be detected [s].
    factors : ndarray of float, shape (f,)
        Safety factors.

    Returns
    -------
    Swept
        False alarms (f,) and latencies (f, contacts) [s], by the rules of `match`.

    Examples
    --------
    `cdtool.benchmark` stores the result in `results.sweep`.
    """
    (swept,) = sweep_operation([detection], contacts, activation, window, {detection.detector: factors})
    assert swept is not None
    return swept


def sweep_operation(
    detections: Sequence[Detection],
    contacts: Sequence[Contact],
    activation: Activation,
    window: float,
    factors: Mapping[str, FloatArray],
) -> tuple[Swept | None, ...]:
    """Return the `sweep` of each detection of one operation; None for a detector without `factors`."""
    spans = windows(contacts, window)
    order = np.argsort([contact.start for contact in contacts], kind="stable")
    ends = [max(closes, contact.end) for contact, _, closes in spans]
    columns = (
        [contact.start for contact, _, _ in spans],
        [opens for _, opens, _ in spans],
        [closes for _, _, closes in spans],
        ends,
    )
    in_time = [np.array(column, dtype=np.float64) for column in columns]
    timed = np.array([not contact.in_progress for contact, _, _ in spans], dtype=bool)
    clocks: list[tuple[FloatArray, npt.NDArray[np.int64]]] = []
    found: list[Swept | None] = []
    for detection in detections:
        if detection.detector not in factors:
            found.append(None)
            continue
        moved = factors[detection.detector]
        ascending = np.argsort(moved, kind="stable")
        false_alarms = np.zeros(len(moved), dtype=np.int64)
        latency = np.full((len(moved), len(contacts)), np.nan)
        statistic, limits = detection.statistic, np.ascontiguousarray(moved[ascending])
        count_alarms(
            np.ascontiguousarray(statistic.time),
            np.ascontiguousarray(detection.exceedance()).ravel(),
            np.ascontiguousarray(statistic.status).ravel(),
            _debounce(clocks, statistic.time, activation),
            np.flatnonzero(begins_at(statistic.time, detection.begins)),
            limits,
            (1.0 - activation.hysteresis) * limits,
            activation.wait,
            *in_time,
            timed,
            false_alarms,
            latency,
        )
        swept = Swept(np.empty_like(false_alarms), np.empty_like(latency))
        swept.false_alarms[ascending] = false_alarms
        swept.latency[ascending[:, np.newaxis], order] = latency
        found.append(swept)
    return tuple(found)


def _debounce(
    clocks: list[tuple[FloatArray, npt.NDArray[np.int64]]], time: FloatArray, activation: Activation
) -> npt.NDArray[np.int64]:
    """Return the debounce at each time, computed once for equal clocks, which are kept in `clocks`."""
    for clock, needed in clocks:
        if np.array_equal(clock, time):
            return needed
    clocks.append((time, activation.needed(time)))
    return clocks[-1][1]


def critical_factor(detection: Detection, activation: Activation) -> float:
    """Return the largest safety factor below which an operation alarms: the highest debounced exceedance of any joint.

    -inf if there are never as many consecutive assessable samples as the debounce needs.
    """
    statistic, met_at = detection.statistic, detection.exceedance()
    needed = activation.needed(statistic.time)
    highest = -np.inf
    for joint in range(met_at.shape[1]):
        status = statistic.status[:, joint]
        present = status != Status.GAP  # a missing sample is skipped, as by the activation
        met = np.where(status == Status.VALID, met_at[:, joint], -np.inf)[present]
        for debounce in np.unique(needed[present]):
            if len(met) >= debounce:
                held = np.lib.stride_tricks.sliding_window_view(met, debounce).min(axis=1)
                there = needed[present][debounce - 1 :] == debounce
                highest = max(highest, float(held[there].max(initial=-np.inf)))
    return highest
