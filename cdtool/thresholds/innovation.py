"""Limits on the prediction error of an autoregressive model (thesis 2.3.1, stochastic difference equations)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

from cdtool.base.settings import NOT_A_KEY, check
from cdtool.detectors.detection import Signal
from cdtool.recordings.recording import Recording
from cdtool.thresholds.sequential import FittedSequential, fit_sequential
from cdtool.thresholds.settings import Order, SafetyFactor, SidesOfMachine
from cdtool.thresholds.signature import Signature


@dataclass(frozen=True)
class Innovation:
    """Limits -+ `safety_factor` on the innovation: the part of a sample that the previous ones do not predict.

    Raises
    ------
    UsageError
        A setting is unknown or outside its range.

    Notes
    -----
    Thesis 2.3.1, stochastic difference equations:

        e = (i - mu(x)) / s(x),   nu_k = e_k - sum a_i e_{k-i},   statistic = nu_k / sd(nu)

    mu and s are those of the signature, learned from at least 10 runs of one class; a is estimated by Burg's recursion
    over all runs. Samples are counted, not timed: the sample rate must be that of the runs. After a gap the model
    restarts from the normal spread. It does not detect slow ramps, which the model predicts. Fails with soft impacts,
    if the noise varies along the stroke, and with a debounce: an innovation is large for only a few samples.

    Examples
    --------
    The innovations of impact-free strokes have a standard deviation of 1.

    >>> import numpy as np
    >>> from cdtool.recordings.recording import Series
    >>> time, valid = np.arange(2001) * 1e-3, np.zeros((2001, 1), dtype=np.uint8)
    >>> channels = {"speed": Series(time, np.full(2001, 0.2), "m/s"), "position": Series(time, 0.2 * time, "m")}
    >>> strokes = [Recording(f"{i}", "", ("axis",), channels) for i in range(10)]
    >>> rng = np.random.default_rng(1)
    >>> noise = [Signal(time, rng.normal(size=(2001, 1)), valid, "N") for _ in strokes]
    >>> fitted = Innovation(order=2).fit(list(zip(strokes, noise)))
    >>> statistic, band = fitted.evaluate(strokes[0], noise[0])
    >>> statistic.values[statistic.valid].std().round(1).item(), band.upper[-1, 0].item()
    (1.0, 5.5)
    """

    safety_factor: SafetyFactor = 5.5
    sides: SidesOfMachine = None
    order: Order = 4
    signature: Annotated[Signature | None, NOT_A_KEY] = None

    name: ClassVar[str] = "innovation"
    needs: ClassVar[tuple[str, ...]] = ("speed", "position")
    fitted: ClassVar[tuple[type, ...]] = (FittedSequential,)
    by_class: ClassVar[bool] = True
    searched: ClassVar[Mapping[str, tuple[int, ...]]] = {"order": (4, 12)}

    def __post_init__(self) -> None:
        check(self)

    def fit(self, pairs: Sequence[tuple[Recording, Signal]]) -> FittedSequential:
        """Learn from impact-free runs of one class of motion; see `Threshold.fit`."""
        return fit_sequential(self, pairs)

    def statistic(self, innovations: Signal, side: int, longest_gap: float) -> Signal:  # noqa: ARG002 - both signs serve
        """Return the innovations unchanged."""
        return innovations
