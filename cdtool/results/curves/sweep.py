"""One detection with all its limits moved: alarms and latencies as functions of the safety factor.

The points of the curve of latency against false alarms (activity monitor operating characteristic, AMOC).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cdtool.alarms.activation import Activation, begins_at
from cdtool.alarms.pipeline import Detection
from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.kernels import READ_ONLY, kernel
from cdtool.detectors.detection import Status, StatusArray
from cdtool.recordings.recording import Contact
from cdtool.truth.matching import windows

_STATUS = "Array(uint8, 1, 'C', readonly=True)"
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
    """Return the `sweep` of each detection of one operation.

    Parameters
    ----------
    detections : sequence of Detection
        The operation with every detector's statistic and threshold.
    contacts : sequence of Contact
        The contacts of the operation.
    activation : Activation
        What raises an alarm.
    window : float
        How long after its onset a contact may be detected [s].
    factors : mapping of str to ndarray of float, shape (f,)
        Safety factors, by detector.

    Returns
    -------
    tuple of Swept or None
        In the order of `detections`; None for a detector without `factors`.

    Examples
    --------
    `cdtool.benchmark` stores the results in `results.sweep`.
    """
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

    Parameters
    ----------
    detection : Detection
        The operation with its signal and its band.
    activation : Activation
        The debounce.

    Returns
    -------
    float
        The factor.

    Examples
    --------
    `cdtool.benchmark` sets the safety factors of a false-alarm budget by it.
    """
    return critical_factors(detection, [activation])[0]


def critical_factors(detection: Detection, activations: Sequence[Activation]) -> list[float]:
    """Return the `critical_factor` of a detection for each of several activations."""
    statistic, met_at = detection.statistic, detection.exceedance()
    highest = [-np.inf] * len(activations)
    for joint in range(met_at.shape[1]):
        status = statistic.status[:, joint]
        present = status != Status.GAP  # a missing sample is skipped, as by the activation
        met = np.where(status == Status.VALID, met_at[:, joint], -np.inf)
        met = met if present.all() else met[present]
        for number, activation in enumerate(activations):
            needed = activation.needed(statistic.time)
            found = highest_held(met, needed if len(met) == len(needed) else needed[present])
            highest[number] = max(highest[number], found)
    return highest


@kernel(f"float64({READ_ONLY}, Array(int64, 1, 'C', readonly=True))")
def highest_held(met: FloatArray, needed: npt.NDArray[np.int64]) -> float:
    """Return the largest value that `needed` (n,) consecutive entries of `met` (n,), counted backward, all reach."""
    best, reached = -np.inf, 0
    for k in range(len(met)):
        reached = reached + 1 if met[k] > best else 0
        if 0 < needed[k] <= reached:
            best = met[k]
            for i in range(k - needed[k] + 1, k):
                best = min(best, met[i])
            reached = 0
            while reached <= k and met[k - reached] > best:
                reached += 1
    return best


@kernel(
    f"void({READ_ONLY}, {READ_ONLY}, {_STATUS}, int64[::1], int64[::1], {READ_ONLY}, {READ_ONLY}, float64, "
    f"{READ_ONLY}, {READ_ONLY}, {READ_ONLY}, {READ_ONLY}, b1[::1], int64[::1], float64[:, ::1])"
)
def count_alarms(  # noqa: C901, PLR0913  a kernel: one loop, arrays one by one
    time: FloatArray,
    met_at: FloatArray,
    status: StatusArray,
    needed: npt.NDArray[np.int64],
    begins: npt.NDArray[np.int64],
    factors: FloatArray,
    calm_factors: FloatArray,
    rearm: float,
    onsets: FloatArray,
    opens: FloatArray,
    closes: FloatArray,
    releases: FloatArray,
    timed: BoolArray,
    false_alarms: npt.NDArray[np.int64],
    latency: FloatArray,
) -> None:
    """Fill `false_alarms` (f,) and `latency` (f, contacts) [s], which is NaN at first.

    `met_at` and `status` (n J,) are those of all joints, sample by sample; at each sample in `begins`, every alarm is
    armed again. `factors` (f,) increase; a value counts as inside for a factor if it is at most its entry in
    `calm_factors`. Contacts are in order of time: an alarm from `opens` to `closes` detects one if it is `timed`, and
    an alarm from `opens` to `releases` is not false.
    """
    count, contacts = len(factors), len(onsets)
    if count == 0:
        return
    joints = len(met_at) // max(len(time), 1)
    # A joint is not swept if the exceedance of an assessable sample is NaN.
    swept = np.ones(joints, dtype=np.bool_)
    for at in range(len(met_at)):
        if np.isnan(met_at[at]) and status[at] == Status.VALID:
            swept[at % joints] = False
    # By joint: the number of factors that the last sample exceeded, were raised, and it was not calm for. They
    # are the smallest ones.
    outside = np.zeros(joints, dtype=np.int64)
    raised = np.zeros(joints, dtype=np.int64)
    restless = np.zeros(joints, dtype=np.int64)
    for j in range(joints):
        restless[j] = count if swept[j] else 0
    all_restless = np.sum(restless)
    # By joint: its samples so far that were not calm for all factors, without gaps.
    present = np.zeros(joints, dtype=np.int64)
    # By joint and factor: how many samples were present at the first one outside, the first one inside, and whether it
    # is armed.
    outside_since = np.zeros((joints, count), dtype=np.int64)
    inside_since = np.zeros((joints, count), dtype=np.int64)
    armed = np.ones((joints, count), dtype=np.bool_)
    # By factor: the last alarm that was counted as false.
    counted = np.zeros(count)
    earliest, begun, k = 0, 0, -1
    while k + 1 < len(time):
        k += 1
        if all_restless == 0:
            at = k * joints
            while at < len(met_at) and (status[at] != Status.VALID or met_at[at] <= calm_factors[0]):
                at += 1
            if at == len(met_at):
                break
            k = at // joints
        while begun < len(begins) and begins[begun] <= k:
            armed[:] = True
            begun += 1
        for j in range(joints):
            at = k * joints + j
            if status[at] == Status.GAP or not swept[j]:
                continue
            present[j] += 1
            now, calm_from = 0, 0
            if status[at] == Status.VALID:
                met, now, calm_from = met_at[at], outside[j], restless[j]
                while now < count and factors[now] < met:
                    now += 1
                while now > 0 and not factors[now - 1] < met:
                    now -= 1
                while calm_from < count and calm_factors[calm_from] < met:
                    calm_from += 1
                while calm_from > 0 and not calm_factors[calm_from - 1] < met:
                    calm_from -= 1
            if calm_from > restless[j]:
                last = k - 1
                while status[last * joints + j] == Status.GAP and last > 0:
                    last -= 1
                for i in range(restless[j], calm_from):
                    since = inside_since[j, i]
                    if last > since and time[last] - time[since] >= rearm:
                        armed[j, i] = True
            for i in range(calm_from, restless[j]):
                inside_since[j, i] = k
            for i in range(outside[j], now):
                outside_since[j, i] = present[j]
            all_restless += calm_from - restless[j]
            outside[j], restless[j] = now, calm_from
            raised[j] = min(raised[j], now)
            while raised[j] < now and present[j] - outside_since[j, raised[j]] + 1 >= needed[k]:
                i = raised[j]
                raised[j] += 1
                was_armed = armed[j, i]
                armed[j, i] = False
                while earliest < contacts and releases[earliest] < time[k]:
                    earliest += 1
                is_false = True
                for c in range(earliest, contacts):
                    if opens[c] > time[k]:
                        break
                    if timed[c] and time[k] <= closes[c] and np.isnan(latency[i, c]):
                        latency[i, c] = max(time[k] - onsets[c], 0.0)
                    if time[k] <= releases[c]:
                        is_false = False
                if was_armed and is_false and (false_alarms[i] == 0 or time[k] - counted[i] > rearm):
                    false_alarms[i] += 1
                    counted[i] = time[k]
