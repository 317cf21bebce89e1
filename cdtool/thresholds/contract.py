"""Check a threshold against its contract: an error in a plug-in becomes one line, not a traceback or a wrong band."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import CdtoolError, RecordingError, SignatureError
from cdtool.base.value_words import fault_and_place
from cdtool.detectors.detection import Band, Signal, contiguous
from cdtool.recordings.recording import Recording
from cdtool.thresholds.base import Evaluable, FittedThreshold, Threshold, exceedance
from cdtool.thresholds.comparison_kernel import unknown_but_valid

_HINT = "an error in the threshold: see docs/own-detector.md"


def checked_fit(rule: Threshold, pairs: Sequence[tuple[Recording, Signal]]) -> FittedThreshold:
    """Return what a rule learns from impact-free runs, after checking it against the contract.

    Parameters
    ----------
    rule : Threshold
        Any threshold; may come from a plug-in.
    pairs : sequence of (Recording, Signal)
        Impact-free runs with the detector's signals.

    Returns
    -------
    FittedThreshold
        What `rule.fit` returned.

    Raises
    ------
    SignatureError
        The rule fails, or returns a class that its `fitted` does not name.

    Examples
    --------
    >>> from cdtool.thresholds.limit import Limit
    >>> checked_fit(Limit(limits=(400.0,)), []).upper
    (400.0,)
    """
    try:
        fitted = rule.fit(pairs)
    except CdtoolError:
        raise
    except Exception as fault:
        raise SignatureError(f"threshold {rule.name} fails: {fault_and_place(fault)}", _HINT) from fault
    if type(fitted) not in rule.fitted:
        names = ", ".join(item.__name__ for item in rule.fitted) or "none"
        raise SignatureError(
            f"threshold {rule.name} returns {type(fitted).__name__}, its `fitted` names {names}", _HINT
        )
    return fitted


def checked_evaluation(threshold: Evaluable, recording: Recording, signal: Signal) -> tuple[Signal, Band]:
    """Return the statistic and band of a fitted threshold, after checking them against the contract.

    Parameters
    ----------
    threshold : Evaluable
        Any known band; may come from a plug-in.
    recording : Recording
        The recording on the load side.
    signal : Signal
        The detector's signal, values (n, J).

    Returns
    -------
    statistic : Signal
        What is compared with the band.
    band : Band
        Lower and upper limit (n, J).

    Raises
    ------
    RecordingError
        The threshold fails, returns other shapes than the signal's, or NaN where its status is valid.

    Examples
    --------
    >>> import numpy as np
    >>> from cdtool.thresholds.limit import Limit
    >>> signal = Signal(np.arange(2.0), np.zeros((2, 1)), np.zeros((2, 1), dtype=np.uint8), "N")
    >>> _, band = checked_evaluation(Limit.given([400.0]), Recording("run", "", ("axis",), {}), signal)
    >>> band.upper[:, 0].tolist()
    [400.0, 400.0]
    """
    name = type(threshold).__name__
    try:
        statistic, band = threshold.evaluate(recording, signal)
    except CdtoolError:
        raise
    except Exception as fault:
        raise RecordingError(f"{recording.name}: threshold {name} fails: {fault_and_place(fault)}", _HINT) from fault
    shape = signal.values.shape
    if any(np.shape(item) != shape for item in (statistic.values, statistic.status, band.lower, band.upper)):
        raise RecordingError(f"{recording.name}: threshold {name} returns another shape than {shape}", _HINT)
    values, status, lower, upper = (item.reshape(-1) for item in contiguous(statistic, band))
    if unknown_but_valid(values, lower, upper, status):
        # NaN exceeds no limit: the threshold would detect nothing without reporting it.
        raise RecordingError(f"{recording.name}: threshold {name} returns NaN where its status is valid", _HINT)
    return statistic, band


def checked_factor(threshold: Evaluable, factor: float) -> Evaluable:
    """Return the threshold with another safety factor.

    Parameters
    ----------
    threshold : Evaluable
        Any known band; may come from a plug-in.
    factor : float
        The safety factor, above 0.

    Returns
    -------
    Evaluable
        What `threshold.with_safety_factor` returned.

    Raises
    ------
    SignatureError
        The threshold fails.

    Examples
    --------
    >>> from cdtool.thresholds.limit import Limit
    >>> checked_factor(Limit.given([400.0]), 1.5).upper
    (600.0,)
    """
    try:
        return threshold.with_safety_factor(factor)
    except CdtoolError:
        raise
    except Exception as fault:
        raise SignatureError(f"threshold {type(threshold).__name__} fails: {fault_and_place(fault)}", _HINT) from fault


def checked_exceedance(
    threshold: Evaluable,
    recording: Recording,
    signal: Signal,
    evaluated: tuple[Signal, Band] | None = None,
) -> tuple[Signal, FloatArray]:
    """Return `exceedance` of a threshold that may come from a plug-in.

    Parameters
    ----------
    threshold : Evaluable
        Any known band.
    recording : Recording
        The recording on the load side.
    signal : Signal
        The detector's signal, values (n, J).
    evaluated : tuple of (Signal, Band), optional
        What `checked_evaluation` returned for them.

    Returns
    -------
    statistic : Signal
        The statistic of the threshold.
    met_at : ndarray of float, shape (n, J)
        The safety factor at which the limit of each sample would be met.

    Raises
    ------
    SignatureError
        The threshold fails.

    Examples
    --------
    See `exceedance`.
    """
    try:
        return exceedance(threshold, recording, signal, evaluated)
    except CdtoolError:
        raise
    except Exception as fault:
        raise SignatureError(f"threshold {type(threshold).__name__} fails: {fault_and_place(fault)}", _HINT) from fault
