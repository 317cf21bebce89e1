"""What an identification says in words: why a parameter is not identifiable, and what it needs."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

from cdtool.base.plain_text import counted, digits
from cdtool.commands.identify.estimate import Missing, NotIdentifiable
from cdtool.commands.identify.identifying_robot import RobotIdentification
from cdtool.commands.identify.joint import JointIdentification
from cdtool.commands.identify.robot.friction_choice import FrictionAnswer, JointFriction
from cdtool.commands.identify.robot.robot_dynamics import FEWEST_RUNS
from cdtool.report.number_text import number, percent


def listed_numbers(values: tuple[float, ...]) -> str:
    """Return numbers with two digits as 0.06, 0.11 and 0.2."""
    texts = [digits(float(f"{value:.2g}")) for value in values]
    return " and ".join([", ".join(texts[:-1]), texts[-1]] if len(texts) > 1 else texts)


def words_of_decision(friction: JointFriction) -> str:
    """Return whether the friction of a joint is new, which, and why the old one stays."""
    if friction.answer is FrictionAnswer.NEW:
        return f"new: {friction.form.value}"
    return f"old: {friction.answer.value}"


def words_of_base_set(item: NotIdentifiable) -> str:
    """Return why the full set of a robot's base parameters is not identifiable, with the numbers that show it."""
    count, missing = item.numbers["base_parameters"], item.numbers["not_determined"]
    numbers = [_conditioned(item.numbers["condition_number"]), f"{missing:.0f} of {count:.0f} not determined"]
    if 0.0 < (uncertain := item.numbers["uncertain_torque_share"]) < 1.0:
        numbers.append(f"together uncertain by {percent(uncertain)} of a joint's torque in other motion")
    others = words_of_needs([kind for kind in item.missing if kind is not Missing.OTHER_MOTION])
    needs = f"a motion of all joints at once{f', {others}' if others else ''}"
    return (
        f"the full set of base parameters is not identifiable from this motion: {', '.join(numbers)}; add {needs}; "
        "the inertias of the machine file are taken as known"
    )


def words_of_robot(robot: RobotIdentification, joints: Sequence[JointIdentification], runs: int) -> list[str]:
    """Return what is known of a whole robot from so many runs, a line each: inertias, torque constants, and so on."""
    inertias = robot.inertias
    lines = [words_of_base_set(item) for item in inertias.not_identifiable]
    if inertias.refused:
        lines.append(f"inertias kept: {inertias.refused}")
    if inertias.is_new:
        count = len(inertias.base.names)
        lines.append(f"new inertias: {counted(count, 'base parameter')}, {_conditioned(inertias.condition_number)}")
    for item in robot.gains.not_identifiable if robot.gains else ():
        name = joints[item.joint].joint
        lines.append(f"{name}: not identifiable: torque constant: add {words_of_needs(item.missing)}")
    if robot.unexplained_share > 0.0:
        lines.append(
            f"left out: {percent(robot.unexplained_share)} of the motion, of which no friction explains the torque "
            "(contact, stop?)"
        )
    if runs < FEWEST_RUNS:
        lines.append("the standard errors do not contain how friction differs from day to day: add logs of three days")
    return lines


def _conditioned(condition: float) -> str:
    return f"condition number {'infinite' if math.isinf(condition) else number(condition)}"


def words_of_needs(missing: Sequence[Missing]) -> str:
    """Return what is missing in words, separated by commas; empty if nothing is."""
    return ", ".join(kind.value for kind in missing)


def words_of_reason(item: NotIdentifiable) -> str:
    """Return why a parameter is not identifiable, with the numbers that show it."""
    reasons = [_REASONS.get(kind, f"not in these logs: {kind.value}") for kind in item.missing]
    numbers = [text.format(item.numbers[key]) for key, text in _NUMBERS.items() if key in item.numbers]
    if math.isfinite(relative := item.relative_error):
        numbers.append(f"its standard error is {percent(relative)} of its value")
    words = "; ".join(reasons) or "these logs show only its sum with another parameter"
    return f"{words} ({', '.join(numbers)})" if numbers else words


_REASONS: Mapping[Missing, str] = {
    Missing.SECOND_SPEED: "too few speeds: viscous friction cannot be told from Coulomb friction",
    Missing.REVERSALS: "one direction: only the sum of friction and constant force is known",
    Missing.ACCELERATION: "hardly any acceleration",
    Missing.MORE_RECORDINGS: "too few runs",
    Missing.SATURATION: "the command never reached a limit",
    Missing.TORQUE_FILTER: "the lag of the logged torque is in it",
    Missing.OTHER_CONTROLLER: (
        "P and PI control, alone or under a position controller, do not explain the controller's output (feed-forward, "
        "or references of another log?)"
    ),
}
# Numbers of a parameter that is not identifiable, as they are shown.
_NUMBERS: Mapping[str, str] = {
    "speeds": "held: {:.0f}",
    "acceleration": "RMS {:.3g}",
    "acceleration_noise": "noise {:.3g}",
    "largest_n": "largest: {:.3g}",
    "lag_s": "{:.3g} s",
    "unexplained_share": "left: {:.0%}",
}
