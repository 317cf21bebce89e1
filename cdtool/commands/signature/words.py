"""The result of an audit of a season, in plain sentences for the screen."""

from __future__ import annotations

import math

from cdtool.base.plain_text import counted
from cdtool.commands.signature.drift import JointDrift, Shown
from cdtool.statistics.interval import Interval
from cdtool.statistics.trends import LEAST_RUNS, Step

NOTHING_SHOWN = "no drift shown"
_INSPECT = "inspect the machine there before relearning"


def verdicts(item: JointDrift) -> tuple[str, ...]:
    """Return the changes shown for a joint, locations first; or that none is, with the drift not excluded.

    Parameters
    ----------
    item : JointDrift
        One joint over the season.

    Returns
    -------
    tuple of str
        One sentence each.

    Examples
    --------
    `cdtool.check_signature` returns the joints of each class.
    """
    lines = [_alarms(item)] if any(run.alarm for run in item.runs) else []
    if item.course.trend is None:
        many = counted(item.course.n, "run")
        return (*lines, f"{many}: too few to show a drift; at least {LEAST_RUNS} are required")
    lines += [_local(shown, item) if shown.place is not None else _overall(shown, item) for shown in item.shown]
    if not item.shown:
        lines.append(f"{NOTHING_SHOWN} at a level of 1 %: {slope_words(item.course.trend.slope)}")
    return tuple(lines)


def place_of(place: float, axis: str, unit: str) -> str:
    """Format a location: at 2.31 m, or 0.52 s after the motion began."""
    return f"at {place:.2f} {unit}" if axis == "travel" else f"{place:.2f} s after the motion began"


def _alarms(item: JointDrift) -> str:
    alarmed = [(i, run.name) for i, run in enumerate(item.runs, 1) if run.alarm]
    number, name = alarmed[0]
    return f"an alarm in {len(alarmed)} of {counted(len(item.runs), 'run')}, first in run {number} ({name})"


def _overall(shown: Shown, item: JointDrift) -> str:
    course = shown.course
    if course.kind == "step" and course.step is not None:
        return f"{_step(course.step, item)}: if something was changed then, relearn from the runs since"
    slope = slope_words(course.trend.slope) if course.trend is not None else ""
    if shown.outward:
        return f"drifts by {slope}: relearn"
    if item.two_sided:
        return f"drifts back towards the middle of the band by {slope}"
    return f"drifts away from the limit by {slope}; contacts are detected later: relearn"


def _local(shown: Shown, item: JointDrift) -> str:
    course, place = shown.course, place_of(shown.place if shown.place is not None else math.nan, item.axis, item.unit)
    if course.kind == "step" and course.step is not None:
        return f"{_step(course.step, item)} {place}: {_INSPECT}"
    slope = slope_words(course.trend.slope) if course.trend is not None else ""
    return f"{'grows' if shown.outward else 'changes'} {place} by {slope}: {_INSPECT}"


def _step(step: Step, item: JointDrift) -> str:
    return f"step of {step.height:+.2g} spreads at run {step.run + 1} ({item.runs[step.run].name})"


def slope_words(slope: Interval) -> str:
    """Format a slope in spreads per run, with as many decimals as its first two digits need."""
    largest = max(abs(slope.value), abs(slope.low), abs(slope.high), 1e-9)
    decimals = max(1 - math.floor(math.log10(largest)), 0)
    value, low, high = (f"{x:z.{decimals}f}" for x in (slope.value, slope.low, slope.high))
    return f"{float(value):+.{decimals}f} spreads per run (95 %: {low} to {high})"
