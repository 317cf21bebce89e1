"""A detector's signal, held against the contract: the mistake of a plug-in becomes one line, not a wrong figure."""

from __future__ import annotations

import traceback
from pathlib import Path
from typing import Any

import numpy as np

from cdtool.detection import Signal, Status
from cdtool.detectors.base import Detector
from cdtool.dynamics import Machine
from cdtool.errors import CdtoolError, RecordingError
from cdtool.recording import Recording


def checked_signal(detector: Detector, recording: Recording, machine: Machine) -> Signal:
    """`detector.signal` of a recording; raises RecordingError where it fails or breaks the contract."""
    try:
        signal = detector.signal(recording, machine)
    except CdtoolError:
        raise
    except Exception as fault:
        place = traceback.extract_tb(fault.__traceback__)[-1]
        words = f"fails: {fault!r} in {Path(place.filename).name}, line {place.lineno}"
        raise _fault(detector, recording, words) from fault
    if problem := _breach(signal, recording):
        raise _fault(detector, recording, problem)
    return signal


def _breach(signal: Any, recording: Recording) -> str:
    """What is wrong with a signal; empty where it keeps the contract."""
    if not isinstance(signal, Signal):
        return f"gives {type(signal).__name__}, no Signal"
    time, values, status = signal.time, signal.values, signal.status
    if not all(isinstance(item, np.ndarray) and item.ndim for item in (time, values, status)):
        return "gives a signal whose times, values or status are no array"
    shape = (len(time), len(signal.joints or recording.joints))
    if values.shape != shape or status.shape != shape:
        return f"gives values {values.shape} and status {status.shape}: {shape} are needed, samples by joints"
    wanted = time.dtype == np.float64 and values.dtype == np.float64 and status.dtype == np.uint8
    if not wanted or time.ndim != 1:
        kinds = f"times as {time.ndim}-dimensional {time.dtype}, values as {values.dtype}, status as {status.dtype}"
        return f"gives {kinds}: a row of float64, float64 and uint8 are needed"
    if np.any(status > max(Status)):
        return f"gives a status of {int(status.max())}: 0 to {max(Status):d} are known"
    if len(set(signal.joints)) < len(signal.joints):
        return f"names a joint twice: {', '.join(signal.joints)}"
    if len(time) > 1 and not np.all(np.diff(time) > 0.0):
        return "gives times that do not strictly increase"
    blind = int(np.count_nonzero(~np.isfinite(values) & (status == Status.VALID)))
    # NaN is above no limit: it would be a detector that sees nothing and does not say so.
    return f"gives {blind} values that are not finite and yet valid" if blind else ""


def _fault(detector: Detector, recording: Recording, problem: str) -> RecordingError:
    return RecordingError(
        f"{recording.name}: detector {detector.name} {problem}", "a fault of the detector: see docs/own-detector.md"
    )
