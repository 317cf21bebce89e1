"""Facts about how late the channels of a log are against each other."""

from __future__ import annotations

from typing import Literal

from cdtool.findings.finding import Fact
from cdtool.frozen import frozen
from cdtool.plain_text import counted

_BALANCE = {
    "derivative": "",
    "two masses": " in the balance of motor and load",
    "momentum balance": " in the momentum balance",
    "deceleration": " by its deceleration alone, without the drive force",
}


def _rounded(value: float, places: int) -> str:
    return f"{round(value, places) + 0.0:.{places}f}"


def _milliseconds(value: float, low: float, high: float) -> str:
    side, sign = ("late", 1.0) if value >= 0.0 else ("early", -1.0)
    low, high = sorted((1e3 * sign * low, 1e3 * sign * high))
    places = 1 if high - low >= 1.0 else 2
    shown = (_rounded(number, places) for number in (1e3 * abs(value), low, high))
    return "{} by {} ms ({} to {})".format(side, *shown)


@frozen
class ChannelShift(Fact):
    """A channel is late by `offset` [s] at the time `at` [s] against the `reference`, with a 95 % interval.

    It rests on so many `events` of those `examined`, contacts or sections of the motion. `drift` [s/s] with its
    interval is None if it is not assessable. `stiff` and `soft` [s] are the offsets in contacts of two kinds, None if
    all are of one kind.
    """

    joint: str
    reference: str
    rests_on: Literal["derivative", "two masses", "momentum balance", "deceleration"]
    offset: float
    low: float
    high: float
    at: float
    event: Literal["contact", "section"]
    events: int
    examined: int
    drift: tuple[float, float, float] | None = None
    stiff: float | None = None
    soft: float | None = None

    variant_field = "reference"

    def sentence(self) -> str:
        """Return offset, drift, what they rest on, and what they cannot tell apart."""
        is_cell = self.rests_on != "derivative"
        of = f" of {self.joint}" if self.joint else ""
        number = f"{self.events} of {self.examined}" if self.events < self.examined else str(self.events)
        times = "" if self.examined == 1 else "s"
        text = (
            f"{'load cell ' if is_cell else ''}{_milliseconds(self.offset, self.low, self.high)} against the "
            f"{self.reference}{of}{_BALANCE[self.rests_on]}, from {number} {self.event}{times}"
        )
        if self.drift:
            places = 0 if self.drift[2] - self.drift[1] >= 2e-6 else 1
            value, low, high = (_rounded(1e6 * number, places) for number in self.drift)
            text += f", at {self.at:.4g} s; drift {value} ppm ({low} to {high})"
        if not is_cell:
            return text
        if self.stiff is None or self.soft is None:
            return f"{text}; one kind of contact: clock, filters and mechanical delay cannot be told apart"
        return (
            f"{text}; {1e3 * self.stiff:.1f} ms in stiff and {1e3 * self.soft:.1f} ms in soft contacts: a clock's "
            "offset is the same in both"
        )


@frozen
class ShiftNotAssessable(Fact):
    """Why a channel's latency against the `reference` is not assessable, in so many `examined` contacts or sections."""

    joint: str
    reference: str
    reason: str
    examined: int

    variant_field = "reason"

    def sentence(self) -> str:
        """Return the reason."""
        of = f" of {self.joint}" if self.joint else ""
        events = f" in {counted(self.examined, 'event')}" if self.examined else ""
        return f"latency against the {self.reference}{of} not assessable{events}: {self.reason}"


@frozen
class MeasuredSynchronisation(Fact):
    """The load cell's synchronisation [s] as measured on all logs; `shown` is the sentence of the audit."""

    synchronisation: float
    shown: str

    def sentence(self) -> str:
        """Return the audit's sentence, and what follows for latencies."""
        return (
            f"synchronisation measured: {self.shown}; latencies are not corrected, their resolution includes "
            f"{1e3 * self.synchronisation:.2f} ms"
        )
