"""Check a threshold against its contract: an error in a plug-in becomes one line, not a traceback or a wrong band."""

from __future__ import annotations

import traceback
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from cdtool.detection import Band, Signal
from cdtool.errors import CdtoolError, RecordingError, SignatureError
from cdtool.recording import FloatArray, Recording
from cdtool.thresholds.base import FittedThreshold, Threshold, exceedance

_HINT = "a fault of the threshold: see docs/own-detector.md"


def checked_fit(rule: Threshold, pairs: Sequence[tuple[Recording, Signal]]) -> FittedThreshold:
    """Return what the rule learns from impact-free runs.

    Raises SignatureError if it fails or returns a class that its `fitted` does not name.
    """
    try:
        fitted = rule.fit(pairs)
    except CdtoolError:
        raise
    except Exception as fault:
        raise SignatureError(f"threshold {rule.name} fails: {_place(fault)}", _HINT) from fault
    if type(fitted) not in rule.fitted:
        names = ", ".join(item.__name__ for item in rule.fitted) or "none"
        raise SignatureError(f"threshold {rule.name} makes {type(fitted).__name__}, its `fitted` names {names}", _HINT)
    return fitted


def checked_evaluation(threshold: FittedThreshold, recording: Recording, signal: Signal) -> tuple[Signal, Band]:
    """Call `threshold.evaluate`; raises RecordingError if it fails or does not return a band of the signal."""
    name = type(threshold).__name__
    try:
        statistic, band = threshold.evaluate(recording, signal)
    except CdtoolError:
        raise
    except Exception as fault:
        raise RecordingError(f"{recording.name}: threshold {name} fails: {_place(fault)}", _HINT) from fault
    shape = signal.values.shape
    if any(np.shape(item) != shape for item in (statistic.values, statistic.status, band.lower, band.upper)):
        raise RecordingError(f"{recording.name}: threshold {name} gives another shape than the signal's {shape}", _HINT)
    unknown = np.isnan(statistic.values) | np.isnan(band.lower) | np.isnan(band.upper)
    if np.any(unknown & statistic.valid):
        # NaN crosses no limit: it would be a threshold that sees nothing and does not say so.
        raise RecordingError(f"{recording.name}: threshold {name} gives NaN where it says that it judges", _HINT)
    return statistic, band


def checked_factor(threshold: FittedThreshold, factor: float) -> FittedThreshold:
    """`threshold.with_safety_factor`; raises SignatureError where it fails."""
    try:
        return threshold.with_safety_factor(factor)
    except CdtoolError:
        raise
    except Exception as fault:
        raise SignatureError(f"threshold {type(threshold).__name__} fails: {_place(fault)}", _HINT) from fault


def checked_exceedance(threshold: FittedThreshold, recording: Recording, signal: Signal) -> tuple[Signal, FloatArray]:
    """`base.exceedance`; raises SignatureError where the threshold fails."""
    try:
        return exceedance(threshold, recording, signal)
    except CdtoolError:
        raise
    except Exception as fault:
        raise SignatureError(f"threshold {type(threshold).__name__} fails: {_place(fault)}", _HINT) from fault


def _place(fault: Exception) -> str:
    frame = traceback.extract_tb(fault.__traceback__)[-1]
    return f"{fault!r} in {Path(frame.filename).name}, line {frame.lineno}"
