"""Whether a channel is what the machine file says it is, by mechanics: what was checked, the answer, what to write."""

from __future__ import annotations

from typing import Literal

from cdtool.findings.finding import Fact
from cdtool.frozen import frozen

Answer = Literal["agrees", "contradicts", "not checked"]

# What is wrong, and what to do about it, by what was found; in braces the fields of the fact.
_CONTRADICTIONS = {
    "friction": (
        "gives power to the machine where friction takes it: at steady speed {value:.3g} {unit} against the motion",
        "reverse the sign of its scale",
    ),
    "start": ("has the opposite sign of the force that the starts need", "reverse the sign of its scale"),
    "place": (
        "is a function of position and speed alone ({share:.2%} of it): the force of a drive shows inertia and dry friction",
        "map the drive's torque, force or current",
    ),
    "other joint": ("follows the motion of {other} and not its own", "put the columns in the order of the joints"),
    "inertia": (
        "the starts show an inertia of {value:.3g} {unit}, the machine file has {expected:.3g} {unit}",
        "correct mass, inertia, transmission ratio or the scale of the torque",
    ),
    "sign": ("has the opposite sign of the derivative of the {other}", "reverse the sign of its scale"),
    "size": (
        "is {value:.4g} times the derivative of the {other}{between}",
        "correct the unit of the {channel}, of the {other} or of the time",
    ),
    "course": ("does not follow the derivative of the {other}: in {share:.0%} of the motion it has the opposite sign", "map another column"),
    "joints": (
        "follows the derivative of the {other} of another joint, {between}",
        "put the columns in the order of the joints",
    ),
}
_AGREES = {
    "friction": "friction takes power: {value:.3g} {unit} at steady speed, {share:.0f} standard errors",
    "inertia": "the starts show an inertia of {value:.3g} {unit}, the machine file has {expected:.3g} {unit}",
    "size": "is {value:.3g} times the derivative of the {other}",
}
_WHY_NOT = {
    "rest": "the joint hardly moves",
    "speed": "the speed contradicts the position",
    "few": "too little motion",
    "one direction": "motion in one direction, with no start that shows the sign",
    "unclear": "the motion does not show it",
    "apart": "in {value:.0%} of the motion it has the opposite sign of the derivative of the {other}",
}


@frozen
class ChannelCheck(Fact):
    """One check of a channel by mechanics; `joint` is empty where there is but one.

    `found` is what holds, for "not checked" why it was not. `value` [unit] is what was seen, `expected` what the
    machine file says, `share` a share or a number of standard errors, `between` two units that differ by the value.
    """

    check: Literal["friction", "inertia", "derivative"]
    answer: Answer
    found: str
    joint: str = ""
    channel: str = ""
    value: float = 0.0
    unit: str = ""
    expected: float = 0.0
    share: float = 0.0
    other: str = ""
    between: str = ""

    variant_field = "check"

    def sentence(self) -> str:
        """Return the answer; of a contradiction also what to write."""
        of = f"of {self.joint}: " if self.joint else ""
        fields = vars(self)
        if self.answer == "agrees":
            return of + _AGREES[self.found].format(**fields)
        if self.answer == "not checked":
            return f"{of}{self.check} not checked: {_WHY_NOT[self.found].format(**fields)}"
        seen, cure = (text.format(**fields) for text in _CONTRADICTIONS[self.found])
        return f"{of}{seen}, not assessable: {cure}, or write confirmed = true under {self.channel} if it is right"
