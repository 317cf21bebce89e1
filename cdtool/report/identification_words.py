"""What an identification says in words: why a parameter is not identifiable, and the motion that would change that."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from cdtool.identification.estimate import Missing, NotIdentifiable
from cdtool.identification.excitation import Excitation, PlannedMotion
from cdtool.plain_text import counted, digits
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


_Reason = Callable[[NotIdentifiable, Excitation | None, str], str]
_REASONS: Mapping[Missing, _Reason] = {
    Missing.SECOND_SPEED: _few_speeds,
    Missing.REVERSALS: _one_direction,
    Missing.ACCELERATION: _weak_acceleration,
    Missing.MORE_RECORDINGS: _too_uncertain,
    Missing.SATURATION: _no_limit,
}
