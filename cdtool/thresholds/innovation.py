"""Limits on the prediction error of an autoregressive model (thesis 2.3.1, stochastic difference equations)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

from cdtool.detection import Signal
from cdtool.errors import UsageError
from cdtool.recording import Recording
from cdtool.thresholds.sequential import LARGEST_ORDER, FittedSequential, fit_sequential
from cdtool.thresholds.settings import check_sides
from cdtool.thresholds.signature import Signature


@dataclass(frozen=True)
class Innovation:
    """Limits -+ `safety_factor` on the innovation: the part of a sample that the previous ones do not predict (2.3.1).

    e = (i - mu(x)) / s(x), nu_k = e_k - sum a_i e_{k-i}, statistic = nu_k / sd(nu), in standard deviations. mu and s
    are the signature's, learned from at least 10 runs of one class; a of order `order` by Burg's recursion over all
    runs. Samples are counted, not timed: the rate must be that of the runs. After a gap the model restarts
    from the normal spread. Does not detect slow ramps, which the model predicts. Fails with soft impacts, if the noise
    varies along the stroke, and with a debounce: an innovation is large for only a few samples.
    """

    safety_factor: float = 5.5
    sides: str | None = None
    order: int = 4
    signature: Signature | None = None

    name: ClassVar[str] = "innovation"
    needs: ClassVar[tuple[str, ...]] = ("speed", "position")
    fitted: ClassVar[tuple[type, ...]] = (FittedSequential,)
    by_class: ClassVar[bool] = True

    def __post_init__(self) -> None:
        check_sides(self.safety_factor, self.sides)
        check_order(self.order)

    def fit(self, pairs: Sequence[tuple[Recording, Signal]]) -> FittedSequential:
        """Learn from impact-free runs of one class; raises SignatureError where they are too few or differ."""
        return fit_sequential(self, pairs)

    def statistic(self, innovations: Signal, side: int, longest_gap: float) -> Signal:  # noqa: ARG002 - both signs serve
        """The innovations themselves."""
        return innovations


def check_order(order: int) -> None:
    """Raise UsageError for an order that no model has."""
    if not 1 <= order <= LARGEST_ORDER:
        raise UsageError(f"order is {order}", f"a whole number from 1 to {LARGEST_ORDER}")
