"""One detection with all its limits moved: alarms and latencies as functions of the safety factor.

The points of the curve of latency against false alarms (activity monitor operating characteristic, AMOC).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cdtool.activation import Activation, begins_at, crossings_of
from cdtool.detection import Status
from cdtool.evaluation.truth.matching import belongs, one_an_event, windows
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
    statistic, met_at = detection.statistic, detection.exceedance()
    spans = windows(contacts, window)
    order = np.argsort([contact.start for contact in contacts], kind="stable")
    alone: list[list[float]] = [[] for _ in factors]
    latency = np.full((len(factors), len(contacts)), np.nan)
    needed = activation.needed(statistic.time)
    fresh = begins_at(statistic.time, detection.begins)
    for joint in range(met_at.shape[1]):
        met = np.ascontiguousarray(met_at[:, joint])
        status = np.ascontiguousarray(statistic.status[:, joint])
        judged = met[status == Status.VALID]
        highest = float(judged.max()) if len(judged) else -np.inf
        for i in np.flatnonzero(factors < highest):
            calm = met <= (1.0 - activation.hysteresis) * factors[i]
            at, armed = crossings_of(statistic.time, met > factors[i], calm, status, needed, activation.wait, fresh)
            times = statistic.time[at]
            alone[i] += [float(time) for time in times[armed] if not belongs(time, spans)]
            for column, (contact, opens, closes) in zip(order, spans, strict=True):
                if contact.in_progress:
                    continue
                inside = times[(times >= opens) & (times <= closes)]
                if len(inside):
                    late = max(float(inside[0]) - contact.start, 0.0)
                    latency[i, column] = np.fmin(latency[i, column], late)
    counts = [len(one_an_event(times, activation.wait)) for times in alone]
    return Swept(np.array(counts, dtype=np.int64), latency)


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
