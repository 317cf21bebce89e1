"""Explanations in plain sentences, for the screen and for reports."""

from __future__ import annotations

import math
from collections.abc import Sequence

from cdtool.evaluation.explanation.explanation import AlarmExplanation, Explanation, MissExplanation
from cdtool.evaluation.explanation.margin import Approach
from cdtool.evaluation.explanation.movement import COMMANDS, Movement


def words(explanation: Explanation) -> list[str]:
    """What happened, how the limit was crossed or not, and what moved first: a sentence or two an entry."""
    if isinstance(explanation, AlarmExplanation):
        return [_headline(explanation), *_crossing(explanation), *_movement(explanation)]
    return [_miss(explanation), *_approaches(explanation), *_movement(explanation)]


def _headline(item: AlarmExplanation) -> str:
    at = f"{item.alarm.time:.3f} s"
    if item.contact is None:
        known = "false alarm" if item.role == "false alarm" else "alarm"
        why = "no contact belongs to it" if item.role == "false alarm" else "this log does not tell of contacts"
        return f"{known} at {at}: {why}"
    late = item.alarm.time - item.contact.start
    what = "alarm" if item.role == "detection" else "further alarm"
    onset = f"onset at {item.contact.start:.3f} s, {item.contact.found_by}"
    return f"{what} at {at}, {_counted(late, 'the contact')} ({onset})"


def _crossing(item: AlarmExplanation) -> list[str]:
    limit = "upper" if item.alarm.side == "above" else "lower"
    values = f"{_figure(item.alarm.statistic)} against {_figure(item.alarm.limit)}{_unit(item.unit)}"
    since = f"{_counted(item.left - item.contact.start, 'the onset')}, " if item.contact else ""
    waited = _counted(item.left - item.alarm.time, "the alarm")
    skipped = f", {item.skipped} missing ones skipped" if item.skipped else ""
    return [
        f"{item.joint}: {item.alarm.side} its {limit} limit, {values}. It left the band for good {since}{waited}, "
        f"which needs {_samples(item.debounce)} outside in succession{skipped}."
    ]


def _miss(item: MissExplanation) -> str:
    at = f"contact at {item.contact.start:.3f} s ({item.contact.found_by})"
    if item.outcome == "not_assessable":
        return f"{at} not assessable: {item.reason}"
    return f"{at} missed: no alarm in the {1e3 * item.watched:.0f} ms that were watched"


def _approaches(item: MissExplanation) -> list[str]:
    lines = [_approach(found, item) for found in item.approaches[:1]]
    others = [f"{found.joint} {_percent(found.held)}" for found in item.approaches[1:]]
    if others:
        lines.append(f"The other joints stood for as long at these shares of their limits: {', '.join(others)}.")
    if item.not_judged and item.outcome == "missed":
        shares = ", ".join(f"{reason} {100.0 * share:.0f} %" for reason, share in item.not_judged.items())
        lines.append(f"Of the samples in that time some could not be judged: {shares}.")
    return lines


def _approach(found: Approach, item: MissExplanation) -> str:
    nearest = found.nearest
    if not math.isnan(found.latched_from):
        return (
            f"{found.joint}: outside the band since {found.latched_from:.3f} s already, before the contact. A new "
            "alarm needs a return into it."
        )
    where = "from" if nearest.margin >= 0.0 else "beyond"
    text = f"{found.joint}: nearest {_counted(nearest.time - item.contact.start, 'the onset')}, "
    text += f"{_figure(abs(nearest.margin))}{_unit(item.unit)} {where} its limit of {_figure(nearest.limit)}"
    text += f" ({_percent(nearest.share)} of it)." if math.isfinite(nearest.share) else "."
    if found.longest:
        needed = f"{_samples(found.longest)} outside in succession, {item.debounce} are needed"
        text += f" At most {needed}."
    if math.isfinite(found.held):
        text += (
            f" For {_samples(item.debounce)} in succession it stood at {_percent(found.held)} of its limit or above."
        )
    return text


def _movement(item: Explanation) -> list[str]:
    moved = [found for found in item.moved if not math.isnan(found.time)]
    end = item.alarm.time if isinstance(item, AlarmExplanation) else math.inf
    sooner, later = [found for found in moved if found.time <= end], [found for found in moved if found.time > end]
    lines = []
    if sooner:
        lines.append(f"Moved first: {_in_order(sooner, item)}.")
        commanded = sooner[0].channel in COMMANDS
        if commanded or (item.contact is None and any(found.channel in COMMANDS for found in sooner)):
            order = "first" if commanded else "as well"
            lines.append(f"The command moved {order}: that, not a contact, may be what the detector noticed.")
        lines += _first_input(sooner, item)
    else:
        lines.append(f"No channel on its own had clearly left its course{' by then' if later else ''}.")
    if later:
        lines.append(f"After the alarm: {_in_order(later, item)}.")
    untold = (("within its usual range", "Within their usual range"), ("too few samples", "Too few samples to tell"))
    for reason, told in untold:
        names = [_channel(found, item) for found in item.moved if found.reason == reason]
        if names and (moved or reason == "too few samples"):
            lines.append(f"{told}: {', '.join(names)}.")
    return lines


def _in_order(moved: Sequence[Movement], item: Explanation) -> str:
    """The channels with the time of each, the first in full."""
    first = f"{_channel(moved[0], item)} {moved[0].direction} {_after_zero(moved[0], item)}"
    return ", ".join([first, *(f"{_channel(found, item)} {found.direction} {_ms(found, item)}" for found in moved[1:])])


def _first_input(moved: Sequence[Movement], item: Explanation) -> list[str]:
    """Which of the detector's own inputs moved first, where another channel did before it."""
    if not item.inputs or moved[0].channel in item.inputs:
        return []
    read = next((found for found in moved if found.channel in item.inputs), None)
    if read is None:
        return [f"Nothing that {item.detector} reads had clearly moved by then: {', '.join(item.inputs)}."]
    return [f"The first that {item.detector} reads: {_channel(read, item)}, {_after_zero(read, item)}."]


def _after_zero(found: Movement, item: Explanation) -> str:
    return _counted(found.time - item.zero, "the onset" if item.contact else "the alarm")


def _ms(found: Movement, item: Explanation) -> str:
    return f"{abs(1e3 * (found.time - item.zero)):.0f} ms{' before' if found.time < item.zero else ''}"


def _channel(found: Movement, item: Explanation) -> str:
    return found.channel if found.joint == item.joint else f"{found.channel} of {found.joint}"


def _counted(seconds: float, event: str) -> str:
    late = round(1e3 * seconds)
    if late == 0:
        return f"at {event}"
    return f"{abs(late)} ms {'after' if late > 0 else 'before'} {event}"


def _samples(count: int) -> str:
    return "1 sample" if count == 1 else f"{count} samples"


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %" if math.isfinite(share) else "never judged for so long"


def _figure(value: float) -> str:
    return f"{value:.4g}" if abs(value) < 1e4 else f"{value:.0f}"


def _unit(unit: str) -> str:
    return "" if unit in ("1", "") else f" {unit}"
