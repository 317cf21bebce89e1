"""The contract of a threshold: a rule that is fitted to impact-free runs, and a band that is evaluated causally."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import Field
from typing import Any, ClassVar, Protocol, Self

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.detectors.detection import Band, Signal, Status, contiguous
from cdtool.recordings.recording import Recording
from cdtool.thresholds.comparison_kernel import factors_met


class Evaluable(Protocol):
    """What a signal is compared with: a band that is evaluated sample by sample.

    Notes
    -----
    Causal: limits up to a sample do not depend on later samples. One number sets the width of the band: both limits are
    linear in the safety factor, and the statistic does not depend on it. Optional: `band_of(recording, statistic)`, the
    band of a statistic that `evaluate` returned with another factor, where that is faster.
    """

    @property
    def safety_factor(self) -> float:
        """How far the limits are from normal; above 0."""
        ...

    def with_safety_factor(self, factor: float) -> Self:
        """Return the threshold with another safety factor."""
        ...

    def evaluate(self, recording: Recording, signal: Signal) -> tuple[Signal, Band]:
        """Return the statistic of a signal and its band.

        Parameters
        ----------
        recording : Recording
            The recording on the load side, without load cell and label.
        signal : Signal
            The detector's signal, values (n, J).

        Returns
        -------
        statistic : Signal
            What is compared with the band, on the signal's clock; status NO_LIMIT where no limit is known.
        band : Band
            Lower and upper limit (n, J), in the statistic's unit.

        Raises
        ------
        CdtoolError
            The recording has no channel in `needs`, or the joints are not those of the runs.
        """
        ...


class FittedThreshold(Evaluable, Protocol):
    """The contract of a fitted threshold: a known band that can be stored."""

    def to_dict(self) -> dict[str, Any]:
        """Return the threshold as JSON values."""
        ...

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Return the threshold that `to_dict` has written."""
        ...


class Threshold(Protocol):
    """The contract of a threshold: a frozen dataclass of the rule's settings.

    Attributes
    ----------
    name : str
        Name in files and reports, and of the entry point of a plug-in.
    needs : tuple of str
        Channels that `fit` and `evaluate` read, next to the signal.
    fitted : tuple of type
        The classes of which `fit` returns an instance; files are read back with them.

    Notes
    -----
    Optional: `by_class`, True if the rule learns each class of motion separately; what it fits then has `motion`, the
    class it belongs to. `per_run`, True, also of what it fits, if the limits are determined in each run itself: `fit`
    needs no runs, and in a log that is cut each stroke is evaluated separately. `searched`, the values that
    `cdtool tune` tries, by the name of the setting. A field `sides` that is None is set to the machine's, a field
    `signature` that is None to [signature] of the benchmark file. docs/own-detector.md has a complete example.
    """

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]
    name: ClassVar[str]
    needs: ClassVar[tuple[str, ...]]
    fitted: ClassVar[tuple[type, ...]]

    @property
    def safety_factor(self) -> float | None:
        """How far the limits are to be from normal, above 0; None if other settings decide."""
        ...

    def fit(self, pairs: Sequence[tuple[Recording, Signal]]) -> FittedThreshold:
        """Learn the threshold from impact-free runs.

        Parameters
        ----------
        pairs : sequence of (Recording, Signal)
            Each run with the detector's signal. Fitting may use whole runs.

        Returns
        -------
        FittedThreshold
            An instance of one of the classes in `fitted`.

        Raises
        ------
        SignatureError
            There are too few runs, or too few valid samples in them.
        """
        ...


def is_per_run(threshold: Threshold | Evaluable | type) -> bool:
    """Return whether a threshold determines its limits in each run itself, so that it needs no impact-free runs.

    Parameters
    ----------
    threshold : Threshold, Evaluable or type
        A rule, what it has fitted, or the class of one.

    Returns
    -------
    bool
        Its `per_run`, which is optional.

    Examples
    --------
    >>> from cdtool.thresholds.baseline import Baseline
    >>> from cdtool.thresholds.limit import Limit
    >>> is_per_run(Baseline()), is_per_run(Limit())
    (True, False)
    """
    return bool(getattr(threshold, "per_run", False))


def exceedance(
    threshold: Evaluable,
    recording: Recording,
    signal: Signal,
    evaluated: tuple[Signal, Band] | None = None,
) -> tuple[Signal, FloatArray]:
    """Return for each sample the safety factor at which its limit would be met.

    Parameters
    ----------
    threshold : Evaluable
        The fitted threshold.
    recording : Recording
        The recording on the load side.
    signal : Signal
        The detector's signal, values (n, J).
    evaluated : tuple of (Signal, Band), optional
        What `threshold.evaluate` returned for them; evaluated here by default.

    Returns
    -------
    statistic : Signal
        The statistic of the threshold.
    met_at : ndarray of float, shape (n, J)
        A sample is outside the band exactly where this is above the safety factor; -inf where nothing is limited.

    Notes
    -----
    Limits are linear in the factor k: upper(k) = a + k b. So k* = k + k (i - upper(k)) / (upper(2 k) - upper(k)).

    Examples
    --------
    With |i| < 400 N at factor 1, a sample of 600 N meets its limit at factor 1.5.

    >>> import numpy as np
    >>> from cdtool.recordings.recording import Recording
    >>> from cdtool.thresholds.limit import Limit
    >>> signal = Signal(np.arange(2.0), np.array([[100.0], [600.0]]), np.zeros((2, 1), dtype=np.uint8), "N")
    >>> _, met_at = exceedance(Limit.given([400.0]), Recording("run", "", ("axis",), {}), signal)
    >>> met_at[:, 0].tolist()
    [0.25, 1.5]
    """
    factor = threshold.safety_factor
    statistic, band = evaluated or threshold.evaluate(recording, signal)
    farther = threshold.with_safety_factor(2.0 * factor)
    band_of = getattr(farther, "band_of", None)
    wider = band_of(recording, statistic) if band_of else farther.evaluate(recording, signal)[1]
    values, _, lower, upper = contiguous(statistic, band)
    _, _, wider_lower, wider_upper = contiguous(statistic, wider)
    met_at = np.empty(values.shape)
    flat = (item.reshape(-1) for item in (values, lower, upper, wider_lower, wider_upper))
    factors_met(*flat, factor, met_at.reshape(-1))
    return statistic, met_at


def with_limits(signal: Signal, lower: FloatArray, upper: FloatArray) -> tuple[Signal, Band]:
    """Return a signal as its own statistic, with its band.

    Parameters
    ----------
    signal : Signal
        The signal, values (n, J).
    lower, upper : ndarray of float, shape (n, J)
        Limits in the signal's unit; infinite: not limited, NaN: no limit is known.

    Returns
    -------
    statistic : Signal
        The signal; its status becomes NO_LIMIT where it is valid and a limit is NaN.
    band : Band
        The two limits.

    Examples
    --------
    >>> import numpy as np
    >>> signal = Signal(np.arange(2.0), np.zeros((2, 1)), np.zeros((2, 1), dtype=np.uint8), "N")
    >>> statistic, _ = with_limits(signal, np.full((2, 1), -np.inf), np.array([[np.nan], [5.0]]))
    >>> [Status(code).name for code in statistic.status[:, 0]]
    ['NO_LIMIT', 'VALID']
    """
    status = signal.status.copy()
    unknown = (np.isnan(lower) | np.isnan(upper)) & (status == Status.VALID)
    status[unknown] = Status.NO_LIMIT
    return signal.changed(status=status), Band(lower, upper)


def set_by_hand(rule: Threshold) -> bool:
    """Return whether the rule's limits or its safety factor differ from the default.

    Parameters
    ----------
    rule : Threshold
        A rule.

    Returns
    -------
    bool
        True if the user has set one of the two.

    Examples
    --------
    >>> from cdtool.thresholds.limit import Limit
    >>> set_by_hand(Limit()), set_by_hand(Limit(safety_factor=3.0))
    (False, True)
    """
    return bool(getattr(rule, "limits", ())) or rule.safety_factor != type(rule)().safety_factor
