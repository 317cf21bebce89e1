"""Explanations in plain sentences, for the screen and for reports."""

from __future__ import annotations

import math
from collections.abc import Sequence

from cdtool.base.plain_text import counted
from cdtool.recordings.recording import REFERENCES, Contact
from cdtool.results.explanation.cause import Cause, CauseKind, Shift
from cdtool.results.explanation.explanation import AlarmExplanation, Explanation, MissExplanation
from cdtool.results.explanation.margin import Approach
from cdtool.results.explanation.movement import COMMANDS, Movement
from cdtool.results.explanation.transient import Transient
from cdtool.thresholds.normal_choice import Absence
from cdtool.truth.matching import IN_PROGRESS

_ABSENT = {
    Absence.BY_HAND: (
        "limits set by hand are not learned from runs",
        "learn a signature with cdtool learn-signature and give it to cdtool detect --signature",
    ),
    Absence.PER_RUN: (
        "the limits are those of the run's own first seconds, and nothing was learned",
        "learn a signature with cdtool learn-signature and give it to cdtool detect --signature",
    ),
    Absence.OLDER_FILE: (
        "the signature file has no normal motion",
        "relearn it with cdtool learn-signature",
    ),
    Absence.FEW_RUNS: (
        "too few impact-free runs of one class of motion have speed and position",
        "learn from three or more that have both",
    ),
    Absence.NO_CLASS: (
        "no learned class of motion is as fast as this run",
        "learn from impact-free runs at this speed",
    ),
    Absence.NO_CHANNELS: (
        "without speed and position the location within the motion is unknown",
        "map both in [channels] of the machine file and relearn",
    ),
}
_REASONS = (
    ("outside since before", "Outside their normal band since before"),
    ("within its usual range", "Within their usual range"),
    ("no departure found", "No clear departure from their own past"),
    ("too few samples", "Too few samples"),
    ("no normal band known here", "No normal band known here"),
)
_SENSOR = {
    CauseKind.SPEED_GLITCH: ("a glitch of the speed sensor", "the position shows no such motion"),
    CauseKind.TORQUE_SPIKE: ("a spike of the torque or motor current", "the speed did not respond"),
    CauseKind.KNOCK: ("a knock on the accelerometer", "speed and torque did not respond"),
}


def words(explanation: Explanation) -> list[str]:
    """Return an explanation in plain sentences.

    Parameters
    ----------
    explanation : AlarmExplanation or MissExplanation
        The explanation.

    Returns
    -------
    list of str
        First the headline: what happened and when. Then one entry per subject: how the limit was crossed or how near
        the joints came to it, the likely cause of an alarm, and the channels in the order in which they moved.

    Examples
    --------
    >>> import cdtool
    >>> log, machine = "sample_logs/gate/stiff/03.csv", "sample_logs/gate/machine.toml"
    >>> ((_, alarm),) = cdtool.explain(log, machine, detector="momentum", limit=[400.0]).events
    >>> words(alarm)[0]
    'alarm at ... s, ... ms after the contact (onset at ... s, load cell)'
    """
    if isinstance(explanation, AlarmExplanation):
        cause = _cause_words(explanation)
        return [_headline(explanation), *_crossing(explanation), *cause, *_movement(explanation)]
    return [_miss(explanation), *_approaches(explanation), *_movement(explanation)]


def _headline(item: AlarmExplanation) -> str:
    at = f"{item.alarm.time:.3f} s"
    if item.role == "in progress":
        return f"alarm at {at}, in a contact {IN_PROGRESS}: no latency"
    if item.contact is None:
        why = {"false alarm": "no contact belongs to it", "further alarm": "of a contact in another operation"}
        return f"{item.role} at {at}: {why.get(item.role, 'this log has no ground truth')}"
    late = item.alarm.time - item.contact.start
    what = "alarm" if item.role == "detection" else "further alarm"
    onset = f"onset at {item.contact.start:.3f} s, {item.contact.found_by}{_unseen(item.contact)}"
    return f"{what} at {at}, {_counted(late, 'the contact')} ({onset})"


def _unseen(contact: Contact) -> str:
    """Return that the onset may be earlier, if load-cell samples are missing."""
    if not contact.hole:
        return ""
    return f", or up to {1e3 * contact.uncertainty:.0f} ms earlier, since {1e3 * contact.hole:.0f} ms of it are missing"


def _crossing(item: AlarmExplanation) -> list[str]:
    limit = "upper" if item.alarm.side == "above" else "lower"
    values = f"{_number(item.alarm.statistic)} against {_number(item.alarm.limit)}{_unit(item.unit)}"
    since = f"{_counted(item.left - item.contact.start, 'the onset')}, " if item.contact else ""
    waited = _counted(item.left - item.alarm.time, "the alarm")
    skipped = f", {item.skipped} missing samples skipped" if item.skipped else ""
    return [
        f"{item.joint}: {item.alarm.side} its {limit} limit, {values}. Last exit from the band {since}{waited} "
        f"(debounce: {_consecutive(item.debounce)} outside{skipped})."
    ]


def _miss(item: MissExplanation) -> str:
    at = f"contact at {item.contact.start:.3f} s ({item.contact.found_by}{_unseen(item.contact)})"
    if item.outcome == "not_assessable":
        return f"{at} not assessable: {item.reason}"
    return f"{at} missed: no alarm within {1e3 * item.watched:.0f} ms"


def _approaches(item: MissExplanation) -> list[str]:
    lines = [_approach(found, item) for found in item.approaches[:1]]
    others = [f"{found.joint} {_percent(found.held)}" for found in item.approaches[1:]]
    if others:
        lines.append(f"Highest share of the limit for that long, other joints: {', '.join(others)}.")
    if item.not_judged and item.outcome == "missed":
        shares = ", ".join(f"{reason} {100.0 * share:.0f} %" for reason, share in item.not_judged.items())
        lines.append(f"Samples not assessable in that time: {shares}.")
    return lines


def _approach(found: Approach, item: MissExplanation) -> str:
    nearest = found.nearest
    if not math.isnan(found.latched_from):
        return (
            f"{found.joint}: already outside the band since {found.latched_from:.3f} s, before the contact; a new "
            "alarm requires a return into the band."
        )
    where = "from" if nearest.margin >= 0.0 else "beyond"
    text = f"{found.joint}: nearest {_counted(nearest.time - item.contact.start, 'the onset')}, "
    text += f"{_number(abs(nearest.margin))}{_unit(item.unit)} {where} its limit of {_number(nearest.limit)}"
    text += f" ({_percent(nearest.share)} of it)." if math.isfinite(nearest.share) else "."
    if found.longest:
        needed = f"{_consecutive(found.longest)} outside; {item.debounce} are required"
        text += f" At most {needed}."
    if math.isfinite(found.held):
        text += f" For {_consecutive(item.debounce)} it was at {_percent(found.held)} of its limit or above."
    return text


def _movement(item: Explanation) -> list[str]:
    lines = [_compared(item)]
    learned = item.absent is None
    # Compared with impact-free runs, the references show the command and are listed separately. A run's own past cannot
    # distinguish a command from the response to it.
    shown = [found for found in item.moved if not (learned and found.channel in REFERENCES)]
    moved = [found for found in shown if not math.isnan(found.time)]
    end = item.alarm.time if isinstance(item, AlarmExplanation) else math.inf
    sooner, later = [found for found in moved if found.time <= end], [found for found in moved if found.time > end]
    band = "left its normal band" if learned else "departed from its own past"
    if sooner:
        lines.append(f"Moved first: {_in_order(sooner, item)}.")
        lines += [] if learned else _commands(sooner, item)
        lines += _first_input(sooner, item)
    else:
        lines.append(f"No single channel had clearly {band}{' by then' if later else ''}.")
    if later:
        lines.append(f"After the alarm: {_in_order(later, item)}.")
    if learned:
        lines += _references(item)
    return lines + _unmoved(shown, item)


def _compared(item: Explanation) -> str:
    """Return what the channels were compared with, or why only with the log's own past and how to change that."""
    if item.absent is None:
        return f"Compared with {item.runs} impact-free runs at the same position in the motion."
    why, next_step = _ABSENT[item.absent]
    return f"No impact-free runs to compare with: {why}; {next_step}. Compared with this log's own past instead."


def _commands(sooner: Sequence[Movement], item: Explanation) -> list[str]:
    commanded = sooner[0].channel in COMMANDS
    if commanded or (item.contact is None and any(found.channel in COMMANDS for found in sooner)):
        moved = "moved first" if commanded else "also moved"
        return [f"The command {moved}: the detector may have responded to it, not to a contact."]
    return []


def _references(item: Explanation) -> list[str]:
    """Return the references compared with the impact-free runs."""
    found = [each for each in item.moved if each.channel in REFERENCES]
    moved = [each for each in found if not math.isnan(each.time)]
    still = [_channel(each, item) for each in found if each.reason == "within its usual range"]
    parts = [f"{_in_order(moved, item)}"] if moved else []
    parts += [f"{', '.join(still)} within the usual range"] if still else []
    return [f"References: {'; '.join(parts)}."] if parts else []


def _unmoved(shown: Sequence[Movement], item: Explanation) -> list[str]:
    moved = any(not math.isnan(found.time) for found in item.moved)
    lines = []
    for reason, label in _REASONS:
        those = [found for found in shown if found.reason == reason]
        if those and (moved or item.absent is None or reason == "too few samples"):
            names = [f"{_channel(found, item)}{_numbers(found)}" for found in those]
            lines.append(f"{label}: {', '.join(names)}.")
    return lines


def _numbers(found: Movement) -> str:
    """Return the largest deviation with the normal mean and spread there, if known."""
    if not math.isfinite(found.mean):
        return ""
    normal = f"{_number(found.mean)} +- {_number(found.spread)}{_unit(found.unit)}"
    return f" (farthest {_number(found.value)} against {normal})"


def _in_order(moved: Sequence[Movement], item: Explanation) -> str:
    """Return the channels with the time of each, the first in full."""

    def in_words(found: Movement, when: str) -> str:
        return f"{_channel(found, item)} {found.direction} {when}{_numbers(found)}"

    first = in_words(moved[0], _after_zero(moved[0], item))
    return ", ".join([first, *(in_words(found, _ms(found, item)) for found in moved[1:])])


def _first_input(moved: Sequence[Movement], item: Explanation) -> list[str]:
    """Return which of the detector's inputs moved first, if another channel moved before it."""
    if not item.inputs or moved[0].channel in item.inputs:
        return []
    read = next((found for found in moved if found.channel in item.inputs), None)
    if read is None:
        return [f"No input of {item.detector} had clearly moved by then: {', '.join(item.inputs)}."]
    return [f"First input of {item.detector}: {_channel(read, item)}, {_after_zero(read, item)}."]


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


def _consecutive(count: int) -> str:
    return counted(count, "sample" if count == 1 else "consecutive sample")


def _percent(share: float) -> str:
    return f"{100.0 * share:.0f} %" if math.isfinite(share) else "not assessable for that long"


def _number(value: float) -> str:
    return f"{value:.4g}" if abs(value) < 1e4 else f"{value:.0f}"


def _unit(unit: str) -> str:
    return "" if unit in ("1", "") else f" {unit}"


def _cause_words(item: AlarmExplanation) -> list[str]:
    """Return the likely cause with its evidence in numbers."""
    return [f"Likely cause: {_cause(item.cause, item)}."]


def _cause(cause: Cause, item: AlarmExplanation) -> str:
    if cause.transient is not None:
        what, why = _SENSOR[cause.kind]
        return f"{what}: {_transient(cause.transient, item)}, and {why}"
    if cause.loss is not None:
        loss = cause.loss
        count = "1 sample" if loss.samples == 1 else f"{loss.samples} samples"
        return (
            f"lost samples: about {count} of {loss.channel} missing from {loss.start:.3f} to {loss.end:.3f} s, "
            f"{_before(item.alarm.time - loss.end)}, and no other cause was found"
        )
    shifts = "; ".join(_shift(shift, item.absent is None) for shift in cause.shifts)
    if cause.kind is CauseKind.CONTACT:
        return f"a contact: {shifts}; both deviations persisted"
    if cause.kind is CauseKind.FRICTION:
        return f"a change of friction: {shifts}; the torque deviation persisted, that of the speed did not"
    if cause.kind is CauseKind.COMMAND:
        return f"a changed command: {shifts}"
    return "not clear"


def _shift(shift: Shift, learned: bool) -> str:
    """Describe a shift; only a learned value is called normal."""
    unit = f" {shift.unit}" if shift.unit not in ("", "1") else ""
    before = f"(normal: {shift.normal:.4g})" if learned else f"(before: {shift.normal:.4g})"
    return f"{shift.channel} of {shift.joint} {shift.value:.4g}{unit} {before}"


def _transient(found: Transient, item: AlarmExplanation) -> str:
    unit = f" {found.unit}" if found.unit not in ("", "1") else ""
    lasted = max(1e3 * (found.end - found.start), 0.0)
    rings = " in both directions" if found.rings else ""
    when = _before(item.alarm.time - found.start)
    return f"{found.channel} of {found.joint} deviated by {found.height:+.3g}{unit}{rings} for {lasted:.0f} ms, {when}"


def _before(seconds: float) -> str:
    late = round(1e3 * seconds) if math.isfinite(seconds) else 0
    return f"{late} ms before the alarm" if late > 0 else "at the alarm"
