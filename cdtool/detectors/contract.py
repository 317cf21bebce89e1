"""Check a detector's signal against the contract: an error in a plug-in becomes one line, not a wrong result."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import CdtoolError, RecordingError
from cdtool.base.kernels import kernel
from cdtool.base.value_words import fault_and_place
from cdtool.detectors.base import Detector
from cdtool.detectors.detection import Signal, Status, StatusArray
from cdtool.machines.dynamics import Machine
from cdtool.recordings.recording import Recording

_HIGHEST_STATUS = int(max(Status))


def checked_signal(detector: Detector, recording: Recording, machine: Machine) -> Signal:
    """Return the signal of a detector after checking it against the contract.

    Parameters
    ----------
    detector : Detector
        Any detector; may come from a plug-in.
    recording : Recording
        A recording on the load side.
    machine : Machine
        The model of its machine.

    Returns
    -------
    Signal
        What `detector.signal` returned.

    Raises
    ------
    RecordingError
        The detector fails, or its signal has wrong shapes, types, times, joints, status codes or marks of lost samples,
        or values that are not finite and yet valid.

    Examples
    --------
    >>> from cdtool.detectors.pure_torque import PureTorque
    >>> from cdtool.machines.linear_axis import LinearAxis
    >>> from cdtool.recordings.recording import Recording, Series
    >>> axis = LinearAxis.of({"coordinates": "load"})
    >>> recording = Recording("run.csv", "run.csv", ("axis",), {"torque": Series([0.0, 0.1], [5.0, 6.0], "N")})
    >>> checked_signal(PureTorque(), recording, axis).values[:, 0].tolist()
    [5.0, 6.0]
    """
    try:
        signal = detector.signal(recording, machine)
    except CdtoolError:
        raise
    except Exception as fault:
        raise _fault(detector, recording, f"fails: {fault_and_place(fault)}") from fault
    if problem := _breach(signal, recording):
        raise _fault(detector, recording, problem)
    return signal


def _breach(signal: Any, recording: Recording) -> str:
    """Return what is wrong with a signal; empty if it meets the contract."""
    if not isinstance(signal, Signal):
        return f"returns {type(signal).__name__}, not a Signal"
    time, values, status = signal.time, signal.values, signal.status
    if not all(isinstance(item, np.ndarray) and item.ndim for item in (time, values, status)):
        return "returns a signal whose times, values or status are not arrays"
    shape = (len(time), len(signal.joints or recording.joints))
    if values.shape != shape or status.shape != shape:
        return f"returns values {values.shape} and status {status.shape}: {shape} are needed, samples by joints"
    wanted = time.dtype == np.float64 and values.dtype == np.float64 and status.dtype == np.uint8
    if not wanted or time.ndim != 1:
        kinds = f"times as {time.ndim}-dimensional {time.dtype}, values as {values.dtype}, status as {status.dtype}"
        return f"returns {kinds}: a 1-dimensional float64 time, float64 values and a uint8 status are needed"
    lost = signal.lost
    if lost is not None and (np.shape(lost) != shape or np.asarray(lost).dtype != np.bool_):
        return f"returns marks of lost samples that are not {shape} of bool, samples by joints"
    highest, unusable = _of_samples(values, status)
    if highest > _HIGHEST_STATUS:
        return f"returns a status of {highest}: 0 to {_HIGHEST_STATUS} are known"
    if len(set(signal.joints)) < len(signal.joints):
        return f"names a joint twice: {', '.join(signal.joints)}"
    # The times of a channel increase.
    if not any(series.time is time for series in recording.channels.values()) and not np.all(time[1:] > time[:-1]):
        return "returns times that do not strictly increase"
    # NaN exceeds no limit: the detector would detect nothing without reporting it.
    return f"returns {unusable} values that are marked as valid but not finite" if unusable else ""


@kernel("UniTuple(int64, 2)(Array(float64, 2, 'A', readonly=True), Array(uint8, 2, 'A', readonly=True))")
def _of_samples(values: FloatArray, status: StatusArray) -> tuple[int, int]:
    """Return the highest status, and the number of valid values that are not finite."""
    highest = 0
    unusable = 0
    for k in range(values.shape[0]):
        for j in range(values.shape[1]):
            highest = max(highest, int(status[k, j]))
            if status[k, j] == Status.VALID and not math.isfinite(values[k, j]):
                unusable += 1
    return highest, unusable


def _fault(detector: Detector, recording: Recording, problem: str) -> RecordingError:
    return RecordingError(
        f"{recording.name}: detector {detector.name} {problem}", "an error in the detector: see docs/own-detector.md"
    )
