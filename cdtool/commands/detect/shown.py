"""Output of `cdtool detect`: alarms, missed contacts and sections that are not assessable, as a table or as JSON."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cdtool.base.plain_text import LISTED, NAMED, counted
from cdtool.commands.console.colour import Toned
from cdtool.commands.console.console import number, plain, print_line, say, table
from cdtool.commands.console.contact_rows import contact_as_json

if TYPE_CHECKING:
    from cdtool.alarms.pipeline import Detection
    from cdtool.commands.detect.contact_force import ForceSummary
    from cdtool.commands.detecting.detection import Detected
    from cdtool.detectors.detection import Alarm
    from cdtool.results.results import ContactResult
    from cdtool.truth.matching import Matching

# Shown next to a negative latency.
_NEGATIVE = "alarm before the onset, within its uncertainty: counted as 0"
# `found_by` of a contact whose onset was found by the rule for the load cell.
_CELL = "load cell"
# The colours of outcomes.
_TONES = {"missed": "bad", "not_assessable": "unknown"}


def show_detected(done: Sequence[Detected], forces: Mapping[str, ForceSummary]) -> None:
    """Print the table of all logs, then sections that are not assessable, signal notes and estimated forces."""
    rows = [
        (found, *of_operation)
        for found in done
        for of_operation in zip(found.detections, found.matchings, found.contact_rows, strict=True)
    ]
    detections = [detection for found in done for detection in found.detections]
    _show(rows, done[0].threshold)
    _show_not_assessable(detections)
    _show_notes(detections)
    for force in list(forces.values())[:LISTED]:
        _show_force(force)
    if len(forces) > LISTED:
        print_line(f"estimated force: and {counted(len(forces) - LISTED, 'more operation')} (--json has all)")


def show_conclusion(done: Sequence[Detected]) -> None:
    """Print in one line how many operations have which verdict, and how many contacts which outcome."""
    verdicts = [detection.verdict.outcome for found in done for detection in found.detections]
    contacts = [item.outcome for found in done for matching in found.matchings for item in matching.matches]
    parts = [
        ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in sorted(Counter(names).items()))
        for names in (verdicts, contacts)
    ]
    words = f"{counted(len(verdicts), 'operation')}: {parts[0]}" if verdicts else "no operation"
    words += f"; {counted(len(contacts), 'contact')}: {parts[1]}" if contacts else "; no contact"
    say(words, tone=next((tone for outcome, tone in _TONES.items() if outcome in (*contacts, *verdicts)), ""))


def as_rows(done: Sequence[tuple[Path, Detected]], forces: Mapping[str, ForceSummary]) -> list[dict[str, Any]]:
    """Return one JSON object per operation."""
    return [
        _as_json(log, found, detection, matching, rows, forces.get(detection.operation.name))
        for log, found in done
        for detection, matching, rows in zip(found.detections, found.matchings, found.contact_rows, strict=True)
    ]


def _show(rows: Sequence[tuple[Detected, Detection, Matching, Sequence[ContactResult]]], threshold: str) -> None:
    """Print a row per alarm, per contact without an alarm, and per operation without either."""
    cells = [cell for row in rows for cell in _rows_of(*row)]
    first = rows[0][1]
    unit = first.statistic.unit
    columns = [("recording", "left"), ("verdict", "left"), ("time\ns", "right"), ("joint", "left")]
    columns += [(f"signal\n{unit}", "right"), ("limit", "right"), ("latency\nms", "right"), ("why", "left")]
    print_line(f"{first.detector}: {plain(threshold)}")
    table(columns, cells)
    rules = {found.onset for found, _, _, contacts in rows for row in contacts if row.found_by == _CELL}
    for rule in sorted(rules):
        say(f"latency from contact onset to alarm, debounce included; onset: {rule}")


def _rows_of(
    found: Detected, detection: Detection, matching: Matching, contacts: Sequence[ContactResult]
) -> list[tuple[object, ...]]:
    from cdtool.commands.detecting.detection import NO_CONTACT
    from cdtool.report.number_text import number as rounded
    from cdtool.results.summary import later_ms

    name = detection.operation.name
    detected = {item.alarm: row for item, row in zip(matching.matches, contacts, strict=True) if item.alarm}
    rows: list[tuple[object, ...]] = []
    for alarm in sorted({*detection.verdict.alarms, *detected}, key=lambda alarm: (alarm.time, alarm.column)):
        contact = detected.get(alarm)
        late = rounded(contact.latency_ms, error=contact.resolution_ms) if contact else "-"
        figures = (number(alarm.statistic, 4), number(alarm.limit, 4), late)
        why = "" if contact else _why_no_latency(found, alarm)
        if contact and contact.clipped:
            why = _NEGATIVE
        if contact and contact.onset_hole_ms:
            later = rounded(later_ms(contact), error=contact.resolution_ms)
            missing = f"up to {later} ms later: load-cell samples missing at the onset"
            why = f"{why}; {missing}" if why else missing
        verdict = Toned("alarm", "bad" if why == NO_CONTACT else "")
        rows.append((name, verdict, f"{alarm.time:.3f}", alarm.joint, *figures, why))
    for item in matching.matches:
        if not item.alarm:
            outcome = item.outcome.replace("_", " ")
            at = "until" if item.contact.in_progress else "at"
            time = item.contact.end if item.contact.in_progress else item.contact.start
            why = f"contact {at} {time:.3f} s{': ' + item.reason if item.reason else ''}"
            rows.append((name, Toned(outcome, _TONES.get(item.outcome, "")), "-", "-", "-", "-", "-", why))
    if not rows:
        outcome = detection.verdict.outcome.replace("_", " ")
        verdict = Toned(outcome, _TONES.get(detection.verdict.outcome, ""))
        rows.append((name, verdict, "-", "-", "-", "-", "-", detection.verdict.reason))
    return rows


def _why_no_latency(found: Detected, alarm: Alarm) -> str:
    """Explain why an alarm has no latency: it repeats the alarm of a contact, or belongs to no contact."""
    from cdtool.commands.detecting.detection import contact_of, same_contact, why_no_contact

    contact = contact_of(found, alarm)
    return why_no_contact(found, alarm) if contact is None else same_contact(found, contact, alarm)


def _show_force(force: ForceSummary) -> None:
    at_alarm = f"{force.at_alarm:.1f} N at the first alarm, " if math.isfinite(force.at_alarm) else ""
    largest = (
        f"largest {force.largest:.1f} N at {force.largest_at:.3f} s" if math.isfinite(force.largest) else "unknown"
    )
    print_line(f"{plain(force.operation)}: estimated force at {plain(str(force.contact))}: {at_alarm}{largest}")


def _show_notes(detections: list[Detection]) -> None:
    """Print the detector's notes on its signal, for as many operations as sections that are not assessable."""
    noted = [detection for detection in detections if detection.statistic.notes]
    for detection in noted[:LISTED]:
        for note in detection.statistic.notes:
            say(f"{detection.operation.name}: {note}")
    if len(noted) > LISTED:
        print_line(f"and {counted(len(noted) - LISTED, 'more operation')} with such a note (--json has all)")


def _show_not_assessable(detections: list[Detection]) -> None:
    """Print the shares of each operation that are not assessable; of a single one the longest sections."""
    shown = [detection for detection in detections if detection.statistic.shares()]
    for detection in shown[:LISTED]:
        parts = _sections(detection) if len(shown) == 1 else [detection.statistic.why_not()]
        if detection.other_speed and detection.verdict.outcome != "not_assessable":  # otherwise it is among the reasons
            parts.append(detection.other_speed)
        say(f"not assessable in {detection.operation.name}: {'; '.join(parts)}")
    if len(shown) > LISTED:
        print_line(f"not assessable: and {counted(len(shown) - LISTED, 'more operation')} (--json has all)")


def _sections(detection: Detection) -> list[str]:
    """Return the share that is not assessable, and time, position and reason of the longest sections."""
    sections = detection.not_assessable_sections()
    longest = sorted(sections, key=lambda item: item.start - item.end)[:NAMED]
    unit = detection.operation.recording["position"].unit if "position" in detection.operation.recording else ""
    parts = [f"{100.0 * (1.0 - float(detection.statistic.valid.mean())):.0f} %"]
    for item in sorted(longest, key=lambda item: item.start):
        is_placed = math.isfinite(item.position_start + item.position_end)
        where = f" ({_place(item.position_start)} to {_place(item.position_end)} {unit})" if is_placed else ""
        parts.append(f"{item.start:.2f} to {item.end:.2f} s{where} {item.reason}")
    if more := len(sections) - len(longest):
        parts.append(f"and {counted(more, 'shorter section')} (--json has all)")
    return parts


def _place(way: float) -> str:
    """Return a position along the travel [load unit] with three digits, at most to a millimetre or milliradian."""
    return f"{round(way, 3) + 0.0:.3g}"


def _as_json(
    log: Path,
    found: Detected,
    detection: Detection,
    matching: Matching,
    rows: Sequence[ContactResult],
    force: ForceSummary | None,
) -> dict[str, Any]:
    from cdtool.commands.detect.rows import alarm_row, operation_row
    from cdtool.commands.detecting.detection import contact_of, why_no_contact

    alarms = detection.verdict.alarms
    why = [None if contact_of(found, alarm) else why_no_contact(found, alarm) for alarm in alarms]
    return {
        "log": str(log),
        **asdict(operation_row(found, detection, matching)),
        "unit": detection.statistic.unit,
        "threshold": found.threshold,
        "alarms": [
            {**asdict(alarm_row(found, detection, alarm)), "why_no_contact": reason}
            for alarm, reason in zip(alarms, why, strict=True)
        ],
        "contacts": [contact_as_json(detection, row) for row in rows],
        "not_judged": detection.statistic.shares(),
        "other_speed": detection.other_speed or None,
        "stretches_not_judged": [asdict(item) for item in detection.not_assessable_sections()],
        "estimated_force": asdict(force) if force else None,
        "notes": list(detection.statistic.notes),
        "findings": _findings(found),
    }


def _findings(found: Detected) -> list[str]:
    read, of_log = (
        map(str, found.recording.findings),
        (item.reason for item in found.findings if item.severity == "warning"),
    )
    return list(dict.fromkeys([*read, *of_log]))
