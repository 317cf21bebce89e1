"""When a contact begins: the settings of the onset rule, in newtons and seconds."""

from __future__ import annotations

import math
from dataclasses import dataclass

from cdtool.base.errors import UsageError

# The longest hold [s]: later the rest level would rest on the contact itself.
LONGEST_HOLD = 0.1
# A setting in samples means those of a load cell of 1 kHz: so many seconds each.
SAMPLE = 1e-3


@dataclass(frozen=True)
class OnsetRule:
    """When a contact begins on the load cell.

    Parameters
    ----------
    above : float, optional
        Upper level over the rest level [N]; by default `sigmas` standard deviations of the noise.
    back_to : float, optional
        Lower level [N], to which the onset is followed back; by default half of the upper level.
    hold : float
        How long the force stays above the upper level, on one side [s]. Each sample stands for one period of the load
        cell: if that is longer, one sample is enough.
    sigmas : float
        Upper level in standard deviations of the noise.
    separation : float
        Contacts closer than this are one contact with a rebound [s].

    Raises
    ------
    UsageError
        A setting is outside its range.

    Examples
    --------
    >>> OnsetRule(above=20.0, back_to=8.0).described
    'load cell above 20 N for 3 ms, followed back to 8 N'
    """

    above: float | None = None
    back_to: float | None = None
    hold: float = 0.003
    sigmas: float = 8.0
    separation: float = 1.0

    def __post_init__(self) -> None:
        for name in ("above", "back_to", "sigmas", "separation"):
            value = getattr(self, name)
            if value is not None and not (value > 0.0 and math.isfinite(value)):
                raise UsageError(f"onset: {name} is {value:g}", "give a finite number above 0")
        if not 0.0 <= self.hold <= LONGEST_HOLD:
            raise UsageError(f"onset: hold is {self.hold:g} s", f"give 0 to {LONGEST_HOLD:g} s")
        if self.above is not None and self.back_to is not None and self.back_to > self.above:
            raise UsageError(f"onset: back_to is {self.back_to:g}, more than above", "give at most the value of above")

    @property
    def described(self) -> str:
        """The rule in words, for reports."""
        above = f"{self.above:g} N" if self.above is not None else f"{self.sigmas:g} standard deviations of the noise"
        back = f"{self.back_to:g} N" if self.back_to is not None else "half of it"
        return f"load cell above {above} for {1e3 * self.hold:g} ms, followed back to {back}"

    def levels(self, noise: float, least: float = 0.0) -> tuple[float, float]:
        """Return upper and lower level [N] for a noise [N]; an upper level from the noise is at least `least` [N]."""
        above = self.above if self.above is not None else max(self.sigmas * noise, least, 1e-9)
        return above, min(self.back_to if self.back_to is not None else 0.5 * above, above)
