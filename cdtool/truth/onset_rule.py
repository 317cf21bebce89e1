"""When a contact begins: the settings of the onset rule, in newtons and seconds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from msgspec import Meta

from cdtool.base.errors import FieldsError
from cdtool.base.settings import Positive, check, setting

# The longest hold [s]: later the rest level would rest on the contact itself.
LONGEST_HOLD = 0.1


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

    above: Annotated[
        Positive | None,
        setting(
            "upper level over the rest level before the contact; default: `sigmas` standard deviations of the noise",
            key="above_n",
            unit="N",
        ),
    ] = None
    back_to: Annotated[
        Positive | None,
        setting("lower level over the rest level, at most `above_n`; default: half of it", key="back_to_n", unit="N"),
    ] = None
    hold: Annotated[
        Annotated[float, Meta(ge=0.0, le=LONGEST_HOLD)],
        setting(
            "how long the force must stay above the upper level; with a slower cell one sample is enough",
            key="hold_s",
            unit="s",
        ),
    ] = 0.003
    sigmas: Annotated[Positive, setting("standard deviations of the noise, if `above_n` is not given")] = 8.0
    separation: Annotated[
        Positive, setting("contacts closer than this are one, with a rebound", key="separation_s", unit="s")
    ] = 1.0

    def __post_init__(self) -> None:
        check(self)
        if self.above is not None and self.back_to is not None and self.back_to > self.above:
            raise FieldsError(("back_to", "above"), f"is {self.back_to:g}, more than above_n", "give at most above_n")

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
