"""The results of a detector on a recording: Signal, Band, Alarm, Verdict."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from enum import IntEnum
from functools import cached_property
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.errors import ConfigurationError, nearest

StatusArray = npt.NDArray[np.uint8]

# The only column of a signal that does not belong to a single joint (an energy, for example).
WHOLE_MACHINE = ("whole machine",)


class Status(IntEnum):
    """Whether a sample of a collision detection signal is assessable, or why not."""

    VALID = 0  #: Assessable.
    START_UP = 1  #: The detector or its threshold is still starting up.
    NOT_APPLICABLE = 2  #: The detector does not apply to this motion.
    GAP = 3  #: Samples of an input are missing.
    NO_LIMIT = 4  #: No limit is known here.
    OTHER_SPEED = 5  #: The speed is not one that the limit was learned at.
    OTHER_RATE = 6  #: The sample rate is not the one that the limit was learned at.


REASONS: Mapping[int, str] = {
    Status.START_UP: "start-up",
    Status.NOT_APPLICABLE: "not applicable",
    Status.GAP: "missing samples",
    Status.NO_LIMIT: "no limit known here",
    Status.OTHER_SPEED: "other speed",
    Status.OTHER_RATE: "other sample rate",
}


@dataclass(frozen=True, eq=False, repr=False)
class Signal:
    """Collision detection signal: `time` (n,) s, `values` and `status` (n, J), `unit`.

    `signed`: the value's sign follows the axis (a force against positive travel is positive); otherwise positive always
    opposes the motion. `joints` names the columns: the monitored joints, or one name for a signal of the whole machine.
    A detector may leave it empty: then the columns are the recording's joints. `notes`: information on how the signal
    was computed. `lost` (n, J): where an input of the detector had no sample, so that the value is based on a held one,
    or on an estimate within a gap; None if no input had gaps.
    """

    time: FloatArray
    values: FloatArray
    status: StatusArray
    unit: str
    signed: bool = True
    joints: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    lost: BoolArray | None = None

    def __repr__(self) -> str:
        return f"Signal({len(self.time)} samples of {', '.join(self.joints)}, unit={self.unit!r})"

    @property
    def valid(self) -> BoolArray:
        """Return (n, J) True where the value is assessable."""
        valid: BoolArray = self.status == Status.VALID
        return valid

    @cached_property
    def period(self) -> float:
        """Return the median sample period [s]; 0 below two samples, where that of a `Series` is NaN."""
        return float(np.median(np.diff(self.time))) if len(self.time) > 1 else 0.0

    def changed(self, **fields: Any) -> Signal:
        """Return the signal with other fields on the same clock: its period stays known, if it is known."""
        signal = replace(self, **fields)
        if "period" in vars(self):
            vars(signal)["period"] = self.period
        return signal

    def know_period(self, period: float) -> None:
        """Store the median sample period [s], known from a channel on the same clock: it need not be computed."""
        vars(self)["period"] = period

    def watching(self, joints: Sequence[str]) -> Signal:
        """Return only the columns of these joints, in their order here; all columns if `joints` is empty.

        A signal of the whole machine is returned unchanged. Raises ConfigurationError for an unknown joint.
        """
        if not joints or WHOLE_MACHINE in (self.joints, tuple(joints)):
            return self
        for joint in joints:
            if joint not in self.joints:
                raise ConfigurationError(f"unknown joint '{joint}'", nearest(joint, self.joints))
        columns = [i for i, joint in enumerate(self.joints) if joint in joints]
        return self.changed(
            values=np.ascontiguousarray(self.values[:, columns]),
            status=np.ascontiguousarray(self.status[:, columns]),
            joints=tuple(self.joints[i] for i in columns),
            lost=None if self.lost is None else self.lost[:, columns],
        )

    def name_of(self, column: int) -> str:
        """Return the name of a column: its joint, or its number from 0 where the columns have no names."""
        return self.joints[column] if self.joints else str(column)

    def rows(self, start: float, end: float) -> slice:
        """Return the rows with start <= time <= end [s]."""
        first, last = np.searchsorted(self.time, start, side="left"), np.searchsorted(self.time, end, side="right")
        return slice(int(first), int(last))

    def part(self, rows: slice) -> Signal:
        """Return these rows of the signal; the signal itself for all rows."""
        if rows == slice(None):
            return self
        lost = None if self.lost is None else self.lost[rows]
        return replace(self, time=self.time[rows], values=self.values[rows], status=self.status[rows], lost=lost)

    def shares(self, start: float = -np.inf, end: float = np.inf) -> dict[str, float]:
        """Return the share of samples not assessable for each reason, over all joints, from `start` to `end` [s]."""
        is_whole = start == -np.inf and end == np.inf
        status = self.status if is_whole else self.status[(self.time >= start) & (self.time <= end)]
        counts = np.bincount(status.ravel(), minlength=len(Status)).tolist()
        return {text: counts[code] / status.size for code, text in REASONS.items() if counts[code]}

    def why_not(self, start: float = -np.inf, end: float = np.inf) -> str:
        """Return these reasons in words, the most frequent first, with their shares, from `start` to `end` [s].

        "no samples" if no sample has a reason, also if all are valid.
        """
        shares = dict(sorted(self.shares(start, end).items(), key=lambda item: -item[1]))
        return ", ".join(f"{text} {100.0 * share:.0f} %" for text, share in shares.items()) or "no samples"


@dataclass(frozen=True, eq=False, repr=False)
class Band:
    """Lower and upper limit of a statistic, both (n, J); infinite = not limited, NaN = no limit known."""

    lower: FloatArray
    upper: FloatArray

    def __repr__(self) -> str:
        return f"Band({len(self.lower)} samples)"

    def part(self, rows: slice) -> Band:
        """Return these rows of the band; the band itself for all rows."""
        if rows == slice(None):
            return self
        return Band(self.lower[rows], self.upper[rows])


def contiguous(statistic: Signal, band: Band) -> tuple[FloatArray, StatusArray, FloatArray, FloatArray]:
    """Return values, status and both limits (n, J) as kernels need them; raises ValueError for limits of other shape.

    A threshold of a plug-in may return a limit of all samples once, or a view that is not contiguous.

    Parameters
    ----------
    statistic : Signal
        What the limits apply to.
    band : Band
        The limits.

    Returns
    -------
    tuple of ndarray
        Values (n, J), status (n, J) as uint8, lower and upper limit (n, J).

    Raises
    ------
    ValueError
        A limit has another shape than the values.

    Examples
    --------
    >>> signal = Signal(np.arange(2.0), np.zeros((2, 1)), np.full((2, 1), Status.VALID, np.uint8), "N")
    >>> contiguous(signal, Band(np.array([[-1.0]]), np.array([[1.0]])))[3].ravel().tolist()
    [1.0, 1.0]
    """
    values = np.ascontiguousarray(statistic.values, dtype=np.float64)
    status = np.ascontiguousarray(statistic.status, dtype=np.uint8)
    lower, upper = (
        limit if np.shape(limit) == values.shape else np.broadcast_to(limit, values.shape)
        for limit in (band.lower, band.upper)
    )
    return (
        values,
        status,
        np.ascontiguousarray(lower, dtype=np.float64),
        np.ascontiguousarray(upper, dtype=np.float64),
    )


@dataclass(frozen=True)
class Alarm:
    """An exit of the statistic from its band: time [s] of the sample that raised the alarm, debounce included.

    `joint` is the name of the joint, `column` its column in the signal. A signal of the whole machine has one column,
    which is named so.
    """

    time: float
    joint: str
    side: Literal["above", "below"]
    statistic: float
    limit: float
    column: int = 0


@dataclass(frozen=True)
class Verdict:
    """One of three outcomes: alarm, no alarm, or not assessable with the reason.

    `alarms` are those an operator would receive: raised, then re-armed only after a while inside the band. `crossings`
    are all debounced exits from the band, including the alarms: a latched alarm must not hide a contact. `rearmed`:
    when each alarm was re-armed [s], infinite if it was not; for plots only, since it depends on samples after the
    alarm.
    """

    outcome: Literal["alarm", "no alarm", "not_assessable"]
    alarms: tuple[Alarm, ...] = ()
    reason: str = ""
    crossings: tuple[Alarm, ...] = ()
    rearmed: tuple[float, ...] = ()
