"""Count alarms and latencies for many safety factors in one pass over a detection.

The rules are those of `crossings_of` (cdtool/activation.py) and of cdtool/evaluation/truth/matching.py. For one sample,
the factors that it exceeds are the smallest ones, since the factors are sorted. So a sample that exceeds as many
factors as the previous one costs one comparison, and a factor costs time only where the value passes its limit.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from cdtool.detection import Status, StatusArray
from cdtool.kernels import READ_ONLY, kernel
from cdtool.recording import BoolArray, FloatArray

_STATUS = "Array(uint8, 1, 'C', readonly=True)"


@kernel(f"b1({READ_ONLY}, {_STATUS}, int64, int64)")
def has_unknown(met_at: FloatArray, status: StatusArray, joint: int, joints: int) -> bool:
    """Return whether the exceedance of an assessable sample of a joint is NaN."""
    unknown = 0
    for k in range(joint, len(met_at), joints):
        unknown += np.isnan(met_at[k]) and status[k] == Status.VALID
    return unknown > 0


@kernel(
    f"void({READ_ONLY}, {READ_ONLY}, {_STATUS}, int64[::1], int64[::1], {READ_ONLY}, {READ_ONLY}, float64, "
    f"{READ_ONLY}, {READ_ONLY}, {READ_ONLY}, {READ_ONLY}, b1[::1], int64[::1], float64[:, ::1])"
)
def count_alarms(
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
    swept = np.empty(joints, dtype=np.bool_)
    # By joint: the number of factors that the last sample exceeded, were raised, and it was not calm for. They
    # are the smallest ones.
    outside = np.zeros(joints, dtype=np.int64)
    raised = np.zeros(joints, dtype=np.int64)
    restless = np.zeros(joints, dtype=np.int64)
    for j in range(joints):
        swept[j] = not has_unknown(met_at, status, j, joints)
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
