"""Facts about the motion in a log, and whether its channels agree with each other."""

from __future__ import annotations

from typing import Literal

from cdtool.findings.finding import Fact, TemplateFact
from cdtool.frozen import frozen
from cdtool.plain_text import counted


@frozen
class NoMotionMapped(TemplateFact):
    """Neither speed nor position is mapped."""

    words = "neither speed nor position is mapped: no operation can be cut or classed"


@frozen
class NoMotion(TemplateFact):
    """The axis stands still."""

    words = "the axis does not move"


@frozen
class Motion(Fact):
    """Strokes, nominal speed and main direction; `joint` leads the motion, empty where there is but one."""

    strokes: int
    nominal_speed: float
    unit: str
    direction: Literal["forward", "backward"]
    joint: str = ""

    def sentence(self) -> str:
        """Return all of it."""
        of = f" of {self.joint}" if self.joint else ""
        return (
            f"{counted(self.strokes, 'stroke')} by motion; nominal speed{of} {self.nominal_speed:.4g} {self.unit}, "
            f"mainly {self.direction}"
        )


@frozen
class SpeedUnitDoubtful(Fact):
    """The integral of the speed and the position differ by a factor, as two units do that are named `as_between`.

    `joint` is empty where there is but one.
    """

    joint: str
    integrated: float
    spanned: float
    position_unit: str
    speed_unit: str
    as_between: str = ""

    def sentence(self) -> str:
        """Return both distances and their ratio."""
        of = f"of {self.joint}: " if self.joint else ""
        ratio = max(self.integrated / self.spanned, self.spanned / self.integrated)
        between = f", as between {self.as_between}" if self.as_between else ""
        return (
            f"{of}integrates to {self.integrated:.4g} {self.position_unit}, the position spans {self.spanned:.4g} "
            f"{self.position_unit} (a factor of {ratio:.4g}{between}): check the units of speed (read as "
            f"{self.speed_unit}) and position (read as {self.position_unit})"
        )


@frozen
class SpeedSignOpposite(Fact):
    """The speed has the opposite sign of the position's derivative; `joint` is empty where there is but one."""

    joint: str

    def sentence(self) -> str:
        """Return the joint."""
        return f"{f'of {self.joint}: ' if self.joint else ''}has the opposite sign of the position's derivative"


@frozen
class JointsSwapped(TemplateFact):
    """The position of one joint follows the speed of another one."""

    joint: str
    follows: str

    words = "that of {joint} follows the speed of {follows}: columns in another order?"


@frozen
class BelowMinimumSpeed(Fact):
    """The nominal speed is below the detector's `minimum` one; `joint` is empty where there is but one."""

    minimum: float
    unit: str
    joint: str = ""

    def sentence(self) -> str:
        """Return the joint and the minimum."""
        of = f" of {self.joint}" if self.joint else ""
        return f"nominal speed{of} below minimum_speed ({self.minimum:g} {self.unit}): not applicable"


@frozen
class Poles(TemplateFact):
    """The friction EKF's poles [rad/s] at the nominal speed."""

    speed: float
    unit: str
    slow: float
    fast: float

    words = "poles at {speed:.3g} {unit}: {slow:.3g} and {fast:.3g} rad/s"


def _of(joint: str) -> str:
    return f" of {joint}" if joint else ""


@frozen
class AccelerometerUncheckable(Fact):
    """The accelerometer cannot be checked against the speed; `joint` is empty where there is but one.

    `correlation` is that with the speed's derivative, where it is what is too small.
    """

    joint: str
    reason: Literal["joint hardly moves", "speed hardly changes", "correlation"]
    correlation: float = 0.0

    variant_field = "reason"

    def sentence(self) -> str:
        """Return the reason."""
        why = {
            "joint hardly moves": "the joint hardly moves",
            "speed hardly changes": "the speed hardly changes",
            "correlation": f"correlation with the speed's derivative {self.correlation:.2f}",
        }[self.reason]
        return f"accelerometer{_of(self.joint)} cannot be checked: {why}"


@frozen
class AccelerometerFit(Fact):
    """`slope` and `correlation` of the acceleration over the speed's derivative; the fit is good."""

    joint: str
    slope: float
    correlation: float

    @property
    def figures(self) -> str:
        """Slope and correlation in words."""
        return f"slope {self.slope:.3g}, correlation {self.correlation:.2f} over the speed's derivative"

    def sentence(self) -> str:
        """Return the fit."""
        return f"accelerometer{_of(self.joint)} fits the speed ({self.figures})"


@frozen
class AccelerometerTurned(AccelerometerFit):
    """The accelerometer is mounted the other way round."""

    def sentence(self) -> str:
        """Return the fit, and the next step."""
        return f"accelerometer{_of(self.joint)} has the opposite sign ({self.figures}): reverse the sign of its scale"


@frozen
class AccelerometerScaleUncheckable(AccelerometerFit):
    """The sign is right, and the correlation too small to check the scale."""

    def sentence(self) -> str:
        """Return the fit."""
        return f"accelerometer{_of(self.joint)}: its scale cannot be checked ({self.figures})"


@frozen
class AccelerometerScaleWrong(AccelerometerFit):
    """The scale is wrong; the log may contain another unit: m/s2 where g is stated, or g.

    The slope may also be a factor as two units differ by that are named `as_between`, of length, angle or time.
    """

    may_hold: Literal["m/s2", "g", ""] = ""
    as_between: str = ""

    def sentence(self) -> str:
        """Return the fit, and the next step."""
        between = f" (a factor as between {self.as_between})" if self.as_between else ""
        advice = {
            "m/s2": "the log may contain m/s2, not g",
            "g": "the log may contain g",
            "": f"check unit and ratio{between}",
        }
        return f"accelerometer{_of(self.joint)} has the wrong scale ({self.figures}): {advice[self.may_hold]}"
