"""The result of an audit of a season, in plain sentences for the screen and for figures."""

from __future__ import annotations

import math

from cdtool.base.plain_text import counted, digits
from cdtool.commands.signature.audit import JointDrift, Shown
from cdtool.statistics.interval import Interval
from cdtool.statistics.trends import LEAST_RUNS

NOTHING_SHOWN = "no drift shown"
_INSPECT = "inspect the machine there before relearning"
# A slope that uses the margin up in more runs than this is as good as none.
_MANY = 100_000


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
    if shown.course.kind == "step":
        return f"{_step(shown, item)}: if something was changed then, relearn from the runs since"
    trend = shown.course.trend
    if trend is None:
        return NOTHING_SHOWN
    if shown.outward:
        return f"drifts by {slope_words(trend.slope)}; {_left(shown.runs_left)}: relearn"
    if item.two_sided:
        return f"drifts back towards the middle of the band by {slope_words(trend.slope)}"
    return f"drifts away from the limit by {slope_words(trend.slope)}; contacts are detected later: relearn"


def _local(shown: Shown, item: JointDrift) -> str:
    place = place_of(shown.place if shown.place is not None else math.nan, item.axis, item.unit)
    if shown.course.kind == "step":
        return f"{_step(shown, item)} {place}: {_INSPECT}"
    trend = shown.course.trend
    if trend is None:
        return NOTHING_SHOWN
    if shown.outward:
        return f"grows {place} by {slope_words(trend.slope)}; {_left(shown.runs_left)}: {_INSPECT}"
    return f"changes {place} by {slope_words(trend.slope)}: {_INSPECT}"


def _step(shown: Shown, item: JointDrift) -> str:
    step = shown.course.step
    if step is None:
        return NOTHING_SHOWN
    return f"step of {step.height:+.2g} spreads at run {step.run + 1} ({item.runs[step.run].name})"


def slope_words(slope: Interval) -> str:
    """Format a slope in spreads per run, with as many decimals as its first two digits need."""
    largest = max(abs(slope.value), abs(slope.low), abs(slope.high), 1e-9)
    decimals = max(1 - math.floor(math.log10(largest)), 0)
    value, low, high = (f"{x:z.{decimals}f}" for x in (slope.value, slope.low, slope.high))
    return f"{float(value):+.{decimals}f} spreads per run (95 %: {low} to {high})"


def _left(runs: Interval) -> str:
    if runs.value < 1.0:
        return "the margin is used up"
    if not runs.value < _MANY:
        return f"the margin is used up in more than {_MANY} runs"
    about = counted(_rounded(runs.value), "run")
    return f"the margin is used up in about {about} ({_count(runs.low)} to {_count(runs.high)})"


def _count(runs: float) -> str:
    return digits(_rounded(runs)) if runs < _MANY else "more"


def _rounded(runs: float) -> float:
    """Whole runs, two digits of them."""
    return float(f"{round(runs):.2g}")
