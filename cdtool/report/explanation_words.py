"""Explanations in plain sentences, for the screen and for reports."""

from __future__ import annotations

import math
from collections.abc import Sequence

from cdtool.base.plain_text import counted
from cdtool.results.explanation.departure import COMMANDS, OUTSIDE, STAYED, UNKNOWN, Departure
from cdtool.results.explanation.explanation import Explanation
from cdtool.results.explanation.glitch import Glitch
from cdtool.results.explanation.margin import Approach
from cdtool.thresholds.normal_motion import Absence
from cdtool.truth.matching import IN_PROGRESS

_LEARN = "learn a signature with cdtool learn-signature and give it to cdtool detect --signature"
_ABSENT = {
    Absence.BY_HAND: f"limits set by hand are not learned from runs; {_LEARN}",
    Absence.PER_RUN: f"the limits are those of the run's own first seconds, and nothing was learned; {_LEARN}",
    Absence.OLDER_FILE: "the signature file is of an earlier version; relearn it with cdtool learn-signature",
    Absence.FEW_RUNS: "too few impact-free runs of one class of motion have speed and position; learn from three or "
    "more that have both",
    Absence.NO_CLASS: "no learned class of motion is as fast as this run; learn from impact-free runs at this speed",
    Absence.NO_CHANNELS: "without speed and position the location within the motion is unknown; map both in "
    "[channels] of the machine file and relearn",
}


def words(item: Explanation) -> list[str]:
    """Return an explanation in plain sentences.

    Parameters
    ----------
    item : Explanation
        The explanation.

    Returns
    -------
    list of str
        First the headline: what happened and when. Then one entry per subject: how the limit was crossed or how near
        the joints came to it, glitches of sensors, and the channels in the order in which they left their normal
        band.

    Examples
    --------
    >>> import cdtool
    >>> log, machine = "sample_logs/gate/stiff/03.csv", "sample_logs/gate/machine.toml"
    >>> ((_, alarm),) = cdtool.explain(log, machine, detector="momentum", settings={"threshold.limits": 400.0}).events
    >>> words(alarm)[0]
    'alarm at ... s, ... ms after the contact (onset at ... s, load cell)'
    """
    lines = [_headline(item), *(_crossing(item) if item.alarm else _approaches(item))]
    return [*lines, *(_glitch(found, item) for found in item.glitches), _compared(item), *_departed(item)]


def _headline(item: Explanation) -> str:
    contact, onset = item.contact, ""
    if contact is not None:
        onset = contact.found_by
        if contact.hole:
            earlier, hole = 1e3 * contact.uncertainty, 1e3 * contact.hole
            onset += f", or up to {earlier:.0f} ms earlier, since {hole:.0f} ms of it are missing"
    if item.alarm is None:
        outcome = "not assessable: " + item.reason
        if item.role == "missed":
            outcome = f"missed: no alarm within {1e3 * item.watched:.0f} ms"
        return f"contact at {item.zero:.3f} s ({onset}) {outcome}"
    at = f"{item.alarm.time:.3f} s"
    if contact is not None:
        what = "alarm" if item.role == "detection" else "further alarm"
        late = _from_zero(item.alarm.time, item, "the contact")
        return f"{what} at {at}, {late} (onset at {contact.start:.3f} s, {onset})"
    if item.role == "in progress":
        return f"alarm at {at}, in a contact {IN_PROGRESS}: no latency"
    why = {"false alarm": "no contact belongs to it", "further alarm": "of a contact in another operation"}
    return f"{item.role} at {at}: {why.get(item.role, 'this log has no ground truth')}"


def _crossing(item: Explanation) -> list[str]:
    assert item.alarm is not None, "of an alarm"
    limit = "upper" if item.alarm.side == "above" else "lower"
    values = f"{_number(item.alarm.statistic)} against {_number(item.alarm.limit)}{_unit(item.unit)}"
    since = f"{_from_zero(item.left, item)}, " if item.contact else ""
    skipped = f", {item.skipped} missing samples skipped" if item.skipped else ""
    return [
        f"{item.joint}: {item.alarm.side} its {limit} limit, {values}. Last exit from the band {since}"
        f"{_counted(item.left - item.alarm.time, 'the alarm')} (debounce: {_consecutive(item.debounce)} "
        f"outside{skipped})."
    ]


def _approaches(item: Explanation) -> list[str]:
    lines = [_approach(found, item) for found in item.approaches[:1]]
    others = [f"{found.joint} {_percent(found.held)}" for found in item.approaches[1:]]
    if others:
        lines.append(f"Highest share of the limit for that long, other joints: {', '.join(others)}.")
    if item.not_judged and item.role == "missed":
        shares = ", ".join(f"{reason} {100.0 * share:.0f} %" for reason, share in item.not_judged.items())
        lines.append(f"Samples not assessable in that time: {shares}.")
    return lines


def _approach(found: Approach, item: Explanation) -> str:
    nearest = found.nearest
    if not math.isnan(found.latched_from):
        return (
            f"{found.joint}: already outside the band since {found.latched_from:.3f} s, before the contact; a new "
            "alarm requires a return into the band."
        )
    where = "from" if nearest.margin >= 0.0 else "beyond"
    text = f"{found.joint}: nearest {_from_zero(nearest.time, item)}, "
    text += f"{_number(abs(nearest.margin))}{_unit(item.unit)} {where} its limit of {_number(nearest.limit)}"
    text += f" ({_percent(nearest.share)} of it)." if math.isfinite(nearest.share) else "."
    if found.longest:
        text += f" At most {_consecutive(found.longest)} outside; {item.debounce} are required."
    if math.isfinite(found.held):
        text += f" For {_consecutive(item.debounce)} it was at {_percent(found.held)} of its limit or above."
    return text


def _glitch(found: Glitch, item: Explanation) -> str:
    end = item.alarm.time if item.alarm else item.zero
    when = _counted(found.start - end, "the alarm" if item.alarm else "the onset")
    if found.kind == "dropout":
        return f"Dropout of {found.channel}: about {counted(found.samples, 'sample')} missing, {when}."
    lasted = f"for {1e3 * (found.end - found.start):.0f} ms" if found.samples > 1 else "in 1 sample"
    what, value = "Spike", f"{found.size:+.3g}"
    if found.kind == "frozen":
        what, value = "Frozen value", f"at {_number(found.size)}"
    where = f"{found.channel} of {found.joint}"
    return f"{what} of {where}: {value}{_unit(found.unit)} {lasted}, {when}."


def _compared(item: Explanation) -> str:
    """Return what the channels were compared with, or why only with the log's own past and how to change that."""
    if item.absent is None:
        return f"Compared with {item.runs} impact-free runs at the same position in the motion."
    return f"No impact-free runs to compare with: {_ABSENT[item.absent]}. Compared with this log's own past instead."


def _departed(item: Explanation) -> list[str]:
    left = [found for found in item.departed if not math.isnan(found.time)]
    end = item.alarm.time if item.alarm else math.inf
    sooner, later = [found for found in left if found.time <= end], [found for found in left if found.time > end]
    course = "previous" if item.absent else "normal"
    lines = [f"No single channel had clearly left its {course} band{' by then' if later else ''}."]
    if sooner:
        lines = [f"Moved first: {_in_order(sooner, item)}.", *_commands(sooner, item), *_first_input(sooner, item)]
    if later:
        lines.append(f"After the alarm: {_in_order(later, item)}.")
    for reason in (STAYED, OUTSIDE, UNKNOWN):
        names = [f"{_channel(found, item)}{_numbers(found)}" for found in item.departed if found.reason == reason]
        if names:
            lines.append(f"{reason.capitalize()}: {', '.join(names)}.")
    return lines


def _commands(sooner: Sequence[Departure], item: Explanation) -> list[str]:
    commanded = sooner[0].channel in COMMANDS
    if commanded or (item.contact is None and any(found.channel in COMMANDS for found in sooner)):
        moved = "moved first" if commanded else "also moved"
        return [f"The command {moved}: the detector may have responded to it, not to a contact."]
    return []


def _first_input(left: Sequence[Departure], item: Explanation) -> list[str]:
    """Return which of the detector's inputs moved first, if another channel moved before it."""
    if not item.inputs or left[0].channel in item.inputs:
        return []
    read = next((found for found in left if found.channel in item.inputs), None)
    if read is None:
        return [f"No input of {item.detector} had clearly moved by then: {', '.join(item.inputs)}."]
    return [f"First input of {item.detector}: {_channel(read, item)}, {_from_zero(read.time, item)}."]


def _in_order(left: Sequence[Departure], item: Explanation) -> str:
    """Return the channels with the time of each, the first in full."""
    parts: list[str] = []
    for found in left:
        when = _from_zero(found.time, item)
        if parts:
            when = f"{abs(1e3 * (found.time - item.zero)):.0f} ms{' before' if found.time < item.zero else ''}"
        parts.append(f"{_channel(found, item)} {found.direction} {when}{_numbers(found)}")
    return ", ".join(parts)


def _numbers(found: Departure) -> str:
    """Return the largest deviation with the normal mean and spread there, if known."""
    if not math.isfinite(found.mean):
        return ""
    normal = f"{_number(found.mean)} +- {_number(found.spread)}{_unit(found.unit)}"
    return f" (farthest {_number(found.value)} against {normal})"


def _channel(found: Departure, item: Explanation) -> str:
    return found.channel if found.joint == item.joint else f"{found.channel} of {found.joint}"


def _from_zero(time: float, item: Explanation, event: str = "") -> str:
    return _counted(time - item.zero, event or ("the onset" if item.contact else "the alarm"))


def _counted(seconds: float, event: str) -> str:
    late = round(1e3 * seconds)
    if late == 0:
        return f"at {event}"
    return f"{abs(late)} ms {'after' if late > 0 else 'before'} {event}"


def _consecutive(count: int) -> str:
    return counted(count, "sample" if count == 1 else "consecutive sample")


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %" if math.isfinite(share) else "not assessable for that long"


def _number(value: float) -> str:
    return f"{value:.4g}" if abs(value) < 1e4 else f"{value:.0f}"


def _unit(unit: str) -> str:
    return "" if unit in ("1", "") else f" {unit}"
