"""Whether a channel is what the machine file says it is, by mechanics: what was checked, the answer, what to write."""

from __future__ import annotations

from typing import Literal

from cdtool.findings.finding import Fact, TemplateFact
from cdtool.frozen import frozen

Answer = Literal["agrees", "contradicts", "not checked"]

# What is wrong, and what to do about it, by what was found; in braces the fields of the fact.
_CONTRADICTIONS = {
    "friction": (
        "gives power to the machine where friction takes it: at steady speed {value:.3g} {unit} against the motion",
        "reverse the sign of its scale",
    ),
    "place": (
        "is a function of position and speed alone ({share:.4%} of it), as no force of a drive is",
        "map the drive's torque, force or current",
    ),
    "other joint": ("follows the motion of {other} and not its own", "put the columns in the order of the joints"),
    "inertia": (
        "the starts show an inertia of {value:.4g} {unit}, the machine file has {expected:.4g} {unit}",
        "correct mass, inertia, transmission ratio or the scale of the torque",
    ),
    "sign": ("has the opposite sign of the derivative of the {other}", "reverse the sign of its scale"),
    "size": (
        "is {value:.4g} times the derivative of the {other}{between}",
        "correct the unit of the {channel}, of the {other} or of the time",
    ),
    "course": (
        "does not follow the derivative of the {other}: in {share:.0%} of the motion it has the opposite sign",
        "map another column",
    ),
    "still": ("is not zero where the {other} rests: {share:.0%} of its motion", "map another column"),
    "joints": (
        "follows the derivative of the {other} of another joint, {between}",
        "put the columns in the order of the joints",
    ),
}
_AGREES = {
    "friction": "friction takes power: {value:.3g} {unit} at steady speed, {share:.0f} standard errors",
    "inertia": "the starts show an inertia of {value:.4g} {unit}, the machine file has {expected:.4g} {unit}",
    "size": "fits the derivative of the {other} (ratio {value:.3f})",
}
_WHY_NOT = {
    "rest": "the joint hardly moves",
    "few": "too little motion",
    "one direction": "motion in one direction, with no start that shows the sign",
    "viscous": "it follows the speed, with neither dry friction nor inertia: it may be a set value of the speed",
    "unclear": "the motion does not show it",
    "apart": "in {value:.0%} of the motion it has the opposite sign of the derivative of the {other}",
}


@frozen
class Confirmed(TemplateFact):
    """The machine file confirms the channel, whatever the mechanics of the machine say."""

    words = "confirmed in the machine file: not checked against the other channels"


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

    @property
    def seen(self) -> str:
        """What was seen, in words, without the joint."""
        if self.answer == "not checked":
            return f"{self.check} not checked: {_WHY_NOT[self.found].format(**vars(self))}"
        words = _CONTRADICTIONS[self.found][0] if self.answer == "contradicts" else _AGREES[self.found]
        return words.format(**vars(self))

    def sentence(self) -> str:
        """Return what was seen; of a contradiction also what to write."""
        text = f"{f'of {self.joint}: ' if self.joint else ''}{self.seen}"
        if self.answer != "contradicts":
            return text
        cure = _CONTRADICTIONS[self.found][1] + ", or write confirmed = true under {channel} if it is right"
        return f"{text}, not assessable: {cure.format(**vars(self))}, and learn again"
