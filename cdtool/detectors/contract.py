"""Check a detector's signal against the contract: an error in a plug-in becomes one line, not a wrong result."""

from __future__ import annotations

from typing import Any

import numpy as np

from cdtool.detection import Signal, Status
from cdtool.detectors.base import Detector
from cdtool.dynamics import Machine
from cdtool.errors import CdtoolError, RecordingError
from cdtool.recording import Recording
from cdtool.value_words import fault_and_place


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
    >>> from cdtool.recording import Recording, Series
    >>> from cdtool.tables import Table
    >>> axis = LinearAxis.from_table(Table({"coordinates": "load"}, "machine.toml"))
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
        return f"returns {kinds}: a row of float64, float64 and uint8 are needed"
    lost = signal.lost
    if lost is not None and (np.shape(lost) != shape or np.asarray(lost).dtype != np.bool_):
        return f"returns marks of lost samples that are not {shape} of bool, samples by joints"
    if np.any(status > max(Status)):
        return f"returns a status of {int(status.max())}: 0 to {max(Status):d} are known"
    if len(set(signal.joints)) < len(signal.joints):
        return f"names a joint twice: {', '.join(signal.joints)}"
    if len(time) > 1 and not np.all(np.diff(time) > 0.0):
        return "returns times that do not strictly increase"
    unusable = int(np.count_nonzero(~np.isfinite(values) & (status == Status.VALID)))
    # NaN exceeds no limit: the detector would detect nothing without reporting it.
    return f"returns {unusable} values that are marked as valid but not finite" if unusable else ""


def _fault(detector: Detector, recording: Recording, problem: str) -> RecordingError:
    return RecordingError(
        f"{recording.name}: detector {detector.name} {problem}", "an error in the detector: see docs/own-detector.md"
    )
