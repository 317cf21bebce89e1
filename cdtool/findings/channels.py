"""Facts about channels: values that no sensor gives, units that disagree, channels that were derived."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import Literal

from cdtool.findings.finding import Fact, TemplateFact
from cdtool.frozen import frozen
from cdtool.plain_text import counted


def _of_joint(joint: str) -> str:
    return f" of joint {joint}" if joint else ""


@frozen
class AbsentTruth(Fact):
    """A column or topic of ground truth that is mapped and not in the log; `similar` is the nearest name in it."""

    what: Literal["column", "topic", "file"]
    name: str
    similar: str = ""

    def sentence(self) -> str:
        """Return the name, and the nearest one."""
        meant = f"; did you mean '{self.similar}'?" if self.similar else ""
        return f"is not in this log: no {self.what} '{self.name}'{meant}"


@frozen
class MissingValues(Fact):
    """Values that are NaN."""

    count: int
    values: int

    def sentence(self) -> str:
        """Return how many of how many."""
        verb = "is" if self.count == 1 else "are"
        return f"{self.count} of {counted(self.values, 'value')} {verb} missing (NaN)"


@frozen
class MaskedValues(Fact):
    """Values that are masked; `joint` is empty where there is but one."""

    count: int
    joint: str

    @property
    @abstractmethod
    def what(self) -> str:
        """What the values are."""

    def sentence(self) -> str:
        """Return how many and why."""
        verb = "is" if self.count == 1 else "are"
        return f"{counted(self.count, 'value')}{_of_joint(self.joint)} {verb} {self.what}, masked"


@frozen
class InfiniteValues(MaskedValues):
    """Infinite values."""

    what = "infinite"


@frozen
class SaturatedValues(MaskedValues):
    """Values at the limits of the sensor's range."""

    what = "at the sensor's limit"


@frozen
class ImpossibleValues(MaskedValues):
    """Values outside of the range that the machine file states, or beyond what any machine reaches."""

    what = "outside the possible range"


@frozen
class ImplausibleValues(Fact):
    """Values far from all that was learned: the first one, where it is, and the usual range."""

    count: int
    joint: str
    first: float
    time: float
    centre: float
    reach: float
    unit: str

    def sentence(self) -> str:
        """Return how many, the first one, and the usual range."""
        verb = "is" if self.count == 1 else "are"
        return (
            f"{counted(self.count, 'value')}{_of_joint(self.joint)} {verb} implausible (first {self.first:.4g} "
            f"{self.unit} at {self.time:.3f} s; usual: {self.centre:.3g} +- {self.reach:.3g} {self.unit}), masked"
        )


@frozen
class Leap:
    """A step from `before` to `after` at `time` [s]; from `new_zero` [s] on values are valid again, NaN if never."""

    time: float
    before: float
    after: float
    new_zero: float = math.nan


@frozen
class LeapingValues(Fact):
    """Values behind leaps that are faster than the machine moves."""

    count: int
    joint: str
    leaps: tuple[Leap, ...]
    unit: str

    def sentence(self) -> str:
        """Return how many, the first leap, and where the values count again."""
        first = self.leaps[0]
        text = (
            f"{counted(self.count, 'value')}{_of_joint(self.joint)} behind {counted(len(self.leaps), 'leap')} faster "
            f"than the machine moves (first from {first.before:.4g} to {first.after:.4g} {self.unit} at "
            f"{first.time:.3f} s), masked"
        )
        zeros = [leap.new_zero for leap in self.leaps if math.isfinite(leap.new_zero)]
        if zeros:
            text += f"; read from a new zero from {zeros[0]:.3f} s on"
            text += f", and at {counted(len(zeros) - 1, 'more time')}" if len(zeros) > 1 else ""
        return text


@frozen
class LearnedInOtherUnit(TemplateFact):
    """A channel whose plausible range was learned in another unit."""

    logged: str
    learned: str

    words = "logged in {logged}, learned in {learned}: not checked for implausible values"


@frozen
class StuckChannel(Fact):
    """A channel that never changes while the machine moves; `joint` is empty where there is but one."""

    joint: str

    def sentence(self) -> str:
        """Return the joint."""
        return f"the value{_of_joint(self.joint)} never changes while the machine moves: stuck?"


@frozen
class UnitContradicted(Fact):
    """The header of a column, and of `more` others, states another unit than the machine file, or none that is known.

    A loss: the channel is not assessable. A note, of a text that is not a unit: a force is not compared with limits.
    `stated` is what the machine file says, `ratio` the factor between both units (0: they measure different things).
    `advice`: what to write if the header is right, with "unit and scale" a scale in the unit `scale`.
    """

    header: str
    header_unit: str
    more: int
    stated: str
    ratio: float
    advice: Literal["unit", "unit and scale", "unit without scale", "other column", "no unit", "confirm"]
    scale: str = ""

    def sentence(self) -> str:
        """Return both units, and what to write if the header is right."""
        if self.advice == "confirm":
            return f"the log does not say that it is in {self.stated}: write unit_confirmed = true if it is"
        more = f" and {self.more} more so" if self.more else ""
        ratio = f" (a factor of {self.ratio:.4g})" if self.ratio else ""
        text = f"the header says '{self.header}'{more}, the machine file {self.stated}{ratio}"
        if self.advice == "no unit":
            cure = "write the unit and scale of its values, and unit_confirmed = true"
            return f"{text}, which the header does not confirm: {cure}"
        if self.advice == "other column":
            return f"{text}, not assessable: map another column, or write unit_confirmed = true if it is this one"
        scale = {"unit and scale": f" with a scale in {self.scale}", "unit without scale": " without that scale"}
        unit = f'unit = "{self.header_unit}"{scale.get(self.advice, "")}'
        return f"{text}, not assessable: write {unit} if the header is right, else unit_confirmed = true"


@frozen
class SpeedWithoutValue(TemplateFact):
    """The speed is mapped, but no message or row has a value of it, as in JointState messages without velocities."""

    words = (
        "no sample has a value: delete the line speed in [channels] of the machine file, and it is derived from the "
        "position; with this line, detectors that need the speed cannot assess anything"
    )


@frozen
class DerivedSpeed(TemplateFact):
    """The speed is the derivative of the position, through two low-passes at `low_pass` [Hz]."""

    low_pass: float

    words = "not in the log: derived causally from position (two first-order low-passes at {low_pass:g} Hz)"


@frozen
class IntegratedPosition(TemplateFact):
    """The position is the integral of the speed."""

    words = "not in the log: the speed, integrated from 0"


@frozen
class IntegratedReference(TemplateFact):
    """The reference position is the integral of the reference speed."""

    words = "not in the log: the reference speed, integrated from the first position"


@frozen
class LinkAccelerations(TemplateFact):
    """Specific forces on the links became their angular accelerations."""

    words = "specific forces [m/s2] became link accelerations [rad/s2], gravity taken off"


@frozen
class AxesHeld(Fact):
    """The axes of a force have clocks of their own: held on that of the `slowest`, up to `age` [s] old."""

    slowest: str
    age: float

    def sentence(self) -> str:
        """Return the clock and the age."""
        return (
            f"its axes have clocks of their own: each is held on the clock of {self.slowest}, "
            f"up to {1e3 * self.age:.3g} ms old"
        )


@frozen
class AbsentFile(AbsentTruth):
    """The file of a load cell beside the log is missing (`reason` is empty) or cannot be used."""

    reason: str = ""

    def sentence(self) -> str:
        """Return the file that was looked for, or why it cannot be used."""
        if self.reason:
            return f"its file '{self.name}' cannot be used: {self.reason}"
        return f"has no file for this log: '{self.name}' does not exist"
