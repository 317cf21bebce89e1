"""What an identification says in words: why a parameter is not identifiable, and the motion that would change that."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

from cdtool.base.plain_text import counted, digits
from cdtool.commands.identify.axis.excitation import Excitation, PlannedMotion
from cdtool.commands.identify.estimate import Missing, NotIdentifiable
from cdtool.commands.identify.identifying_robot import RobotIdentification
from cdtool.commands.identify.joint import JointIdentification
from cdtool.commands.identify.robot.friction_choice import FrictionAnswer, JointFriction
from cdtool.commands.identify.robot.robot_dynamics import FEWEST_RUNS
from cdtool.commands.identify.robot.robot_excitation import PlannedRobotMotion
from cdtool.report.number_text import number, percent

_BOTH = 2


def short_number(value: float, significant: int = 3) -> str:
    """Return a number with few significant digits and without an exponent; a dash for one that is not finite."""
    return digits(float(f"{value:.{significant}g}")) if math.isfinite(value) else "-"


def listed_numbers(values: tuple[float, ...], significant: int = 3) -> str:
    """Return numbers as 0.06, 0.11 and 0.2."""
    texts = [short_number(value, significant) for value in values]
    return " and ".join([", ".join(texts[:-1]), texts[-1]] if len(texts) > 1 else texts)


def words_of_plan(plan: PlannedMotion, travel_unit: str) -> str:
    """Return a planned motion in one line: runs, speeds, directions and acceleration in numbers.

    A plan that is not a motion, or for which the logs have no basis, names what is missing.
    """
    if math.isfinite(plan.rate):
        return f"logs with at least {short_number(plan.rate)} samples per second"
    if not plan.runs:
        return plan.missing.value
    more = "more " if plan.missing is Missing.MORE_RECORDINGS else ""
    way = "in each direction" if len(plan.directions) == _BOTH else "forward" if plan.directions == (1,) else "backward"
    each = " each" if len(plan.speeds) > 1 else ""
    words = f"{counted(plan.runs, f'{more}run')} {way} at {listed_numbers(plan.speeds)} {travel_unit}/s{each}"
    if plan.logged_speeds and plan.speeds != plan.logged_speeds:
        words += f", beside those at {listed_numbers(plan.logged_speeds)} {travel_unit}/s"
    if math.isfinite(plan.acceleration):
        words += f", with an acceleration of at least {short_number(plan.acceleration, 2)} {travel_unit}/s²"
        words += f" (logged: {short_number(plan.logged_acceleration, 2)})"
    if math.isfinite(plan.rest):
        words += f", from a rest of at least {short_number(plan.rest)} s and until {short_number(plan.motion)} s later"
    if plan.missing in (Missing.SECOND_SPEED, Missing.REVERSALS) and math.isfinite(plan.travel):
        words += f", over {short_number(plan.travel, 2)} {travel_unit}"
    return words


def words_of_joint_plan(plan: PlannedMotion, joint: JointIdentification) -> str:
    """Return a planned motion of a joint in one line; of a robot with the logged one unless it is a series of runs."""
    travel = joint.units[2]
    words = words_of_plan(plan, travel)
    if plan.runs or joint.evidence is None or not joint.evidence.motion.is_moving:
        return words
    motion = joint.evidence.motion
    speed = short_number(motion.excitation.highest_speed)
    return f"{words} (logged: {short_number(motion.range)} {travel}, up to {speed} {travel}/s)"


def words_of_decision(friction: JointFriction) -> str:
    """Return whether the friction of a joint is new, which, and why the old one stays."""
    if friction.answer is FrictionAnswer.NEW:
        return f"new: {friction.form.value}"
    return f"old: {friction.answer.value}"


def words_of_base_set(item: NotIdentifiable) -> str:
    """Return why the full set of a robot's base parameters is not identifiable, with the numbers that show it."""
    condition = item.numbers.get("condition_number", math.nan)
    numbers = [_conditioned(condition)]
    count, missing = (int(item.numbers.get(key, 0.0)) for key in ("base_parameters", "not_determined"))
    if count:
        numbers.append(f"{missing} of {count} not determined")
    uncertain = item.numbers.get("uncertain_torque_share", math.nan)
    if 0.0 < uncertain < 1.0:
        numbers.append(f"together uncertain by {percent(uncertain)} of a joint's torque in other motion")
    others = words_of_needs([kind for kind in item.missing if kind is not Missing.OTHER_MOTION])
    needs = f"a motion of all joints at once{f', {others}' if others else ''}"
    return (
        f"the full set of base parameters is not identifiable from this motion: {', '.join(numbers)}; add {needs}; "
        "the inertias of the machine file are taken as known"
    )


def words_of_robot_plan(plan: PlannedRobotMotion, joints: Sequence[JointIdentification]) -> str:
    """Return the motion that would show the inertias of all links: duration, and range and speed of each joint."""
    parts = []
    for demand in plan.joints:
        name, unit = joints[demand.joint].joint, joints[demand.joint].units[2]
        logged = f"{short_number(demand.logged_range, 2)} {unit}, {short_number(demand.logged_speed, 2)} {unit}/s"
        wanted = f"{short_number(demand.range, 2)} {unit} at up to {short_number(demand.speed, 2)} {unit}/s"
        parts.append(f"{name} over {wanted} ({f'logged: {logged}' if demand.is_more else 'as logged'})")
    return (
        f"{short_number(plan.duration)} s of all joints at once, each at its own frequencies "
        f"(logged: {short_number(plan.logged_duration, 2)} s): {'; '.join(parts)}"
    )


def words_of_robot(robot: RobotIdentification, joints: Sequence[JointIdentification], runs: int) -> list[str]:
    """Return what is known of a whole robot from so many runs, a line each: inertias, torque constants, and so on."""
    inertias = robot.inertias
    lines = [words_of_base_set(item) for item in inertias.not_identifiable]
    if robot.plan is not None:
        lines.append(f"plan: {words_of_robot_plan(robot.plan, joints)}")
    if inertias.refused:
        lines.append(f"inertias kept: {inertias.refused}")
    if inertias.is_new:
        count = len(inertias.base)
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
    if not robot.repeated.pairs:
        lines.append("no motion is repeated: the deviation between equal runs is not known")
    return lines


def _conditioned(condition: float) -> str:
    return f"condition number {'infinite' if math.isinf(condition) else number(condition)}"


def words_of_needs(missing: Sequence[Missing]) -> str:
    """Return what is missing in words, separated by commas; empty if nothing is."""
    return ", ".join(kind.value for kind in missing)


def words_of_reason(item: NotIdentifiable, excitation: Excitation | None, travel_unit: str) -> str:
    """Return why a parameter is not identifiable, with the numbers that show it."""
    reasons = [_REASONS[kind](item, excitation, travel_unit) for kind in item.missing if kind in _REASONS]
    others = [f"not in these logs: {kind.value}" for kind in item.missing if kind not in _REASONS]
    return "; ".join([*reasons, *others]) or "these logs show only its sum with another parameter"


def _few_speeds(item: NotIdentifiable, excitation: Excitation | None, travel_unit: str) -> str:
    if excitation is not None and excitation.speeds:
        held = f"{counted(len(excitation.speeds), 'speed')} ({listed_numbers(excitation.speeds)} {travel_unit}/s)"
    else:
        held = counted(int(item.numbers.get("speeds", 0.0)), "held speed")
    return f"{held}: viscous friction cannot be told from Coulomb friction"


def _one_direction(_: NotIdentifiable, excitation: Excitation | None, __: str) -> str:
    share = "" if excitation is None else f" ({percent(max(excitation.forward_share, 1.0 - excitation.forward_share))})"
    return f"one direction{share}: only the sum of friction and constant force is known"


def _weak_acceleration(item: NotIdentifiable, excitation: Excitation | None, travel_unit: str) -> str:
    if excitation is None or "acceleration" not in item.numbers:
        return "hardly any acceleration"
    return (
        f"hardly any acceleration: {number(excitation.acceleration)} {travel_unit}/s² RMS, "
        f"noise {number(excitation.acceleration_noise)}"
    )


def _too_uncertain(item: NotIdentifiable, _: Excitation | None, __: str) -> str:
    numbers = item.numbers
    value, error = abs(numbers.get("value", 0.0)), numbers.get("standard_error", math.nan)
    relative = numbers.get("relative_standard_error", error / value if value > 0.0 else math.nan)
    return f"its standard error is {percent(relative)} of its value" if math.isfinite(relative) else "too few runs"


def _no_limit(item: NotIdentifiable, _: Excitation | None, __: str) -> str:
    largest = item.numbers.get("largest_n")
    return "the command never reached a limit" + ("" if largest is None else f" (largest: {number(largest)})")


def _unknown_filter(item: NotIdentifiable, _: Excitation | None, __: str) -> str:
    lag = item.numbers.get("lag_s", math.nan)
    size = f" of {number(1e3 * lag)} ms" if math.isfinite(lag) else ""
    return f"the lag{size} between command and measured torque contains the unknown one of the torque's low-pass"


def _other_controller(item: NotIdentifiable, _: Excitation | None, __: str) -> str:
    left = percent(item.numbers.get("unexplained_share", math.nan))
    return (
        f"P and PI control, alone or under a position controller, leave {left} of the controller's output unexplained "
        "(feed-forward, or references of another log?)"
    )


def _no_position(_: NotIdentifiable, __: Excitation | None, ___: str) -> str:
    return "no position channel: a delay of the speed channel looks like damping"


_Reason = Callable[[NotIdentifiable, Excitation | None, str], str]
_REASONS: Mapping[Missing, _Reason] = {
    Missing.SECOND_SPEED: _few_speeds,
    Missing.REVERSALS: _one_direction,
    Missing.ACCELERATION: _weak_acceleration,
    Missing.MORE_RECORDINGS: _too_uncertain,
    Missing.SATURATION: _no_limit,
    Missing.TORQUE_FILTER: _unknown_filter,
    Missing.OTHER_CONTROLLER: _other_controller,
    Missing.POSITION: _no_position,
}
