"""What a trigger plot says of a trace: order of its rows, verdicts, triggers; the same in a figure and on the page."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

from cdtool.base.plain_text import counted
from cdtool.report.number_text import number, spoken
from cdtool.report.plots.panels import trigger_spans
from cdtool.report.table import shown
from cdtool.results.results import Results
from cdtool.results.traces.trace import ContactOutcome, Panel, Span, Trace


@dataclass(frozen=True)
class LatencyTexts:
    """Latencies as the tables write them, by group, recording, detector and the latency itself [ms]."""

    known: Mapping[tuple[str, str, str, float], str]

    @classmethod
    def of(cls, results: Results) -> LatencyTexts:
        """Return those of all detected contacts."""
        rows = [(row, row.latency_ms) for row in results.contacts if row.latency_ms is not None]
        return cls(
            {
                (row.group, row.recording, row.detector, round(late, 3)): number(late, error=row.resolution_ms)
                for row, late in rows
            }
        )

    def text(self, group: str, recording: str, detector: str, late: float) -> str:
        """Return a latency [s] in ms; one that is not among the results has three digits."""
        late *= 1e3
        return self.known.get((group, recording, detector, round(late, 3)), number(late))


#: Three digits for each.
UNKNOWN = LatencyTexts({})


def rows_in_order(trace: Trace) -> list[Panel]:
    """Return the panels, that of the fastest detector first and those that are not assessable last."""
    contact = trace.shown
    return sorted(trace.panels, key=lambda row: (_late(trace, row), contact is not None and _blind(trace, row)))


def verdict_of(trace: Trace, row: Panel, texts: LatencyTexts) -> tuple[str, str]:
    """Return latency, miss or alarm of a row, and a detail: why it is not assessable, or its false alarms."""
    seen = _seen(trace, row)
    if _blind(trace, row):
        return "not assessable", (seen.reason if seen else "") or row.reason
    count = len(row.false_alarms)
    false = counted(count, "false alarm") if count else ""
    if seen is None:
        return (false or "no alarm"), ""
    if seen.outcome == "detected":
        return f"{texts.text(trace.group, trace.log, row.detector, seen.late)} ms", false
    return spoken(seen.outcome), false


def triggers_of(trace: Trace, row: Panel, span: Span) -> list[Span]:
    """Return from when to when the trigger is on within `span` [s]: each alarm until it is re-armed.

    If the contact's detection is a crossing during an earlier alarm, it begins an interval of its own.
    """
    held = trigger_spans(row.alarms, row.rearmed, trace.end)
    seen = _seen(trace, row)
    if seen and seen.outcome == "detected" and seen.alarm not in row.alarms:
        current = next(((start, end) for start, end in held if start <= seen.alarm <= end), (seen.alarm, trace.end))
        cut = [(start, seen.alarm) if (start, end) == current else (start, end) for start, end in held]
        held = [*cut, (seen.alarm, current[1])]
    return [(start, min(end, span[1])) for start, end in held if start <= span[1] and end >= span[0]]


def trace_words(trace: Trace) -> list[str]:
    """Return group, contact and peak force of a trace."""
    contact = trace.shown
    words = [shown(trace.group)]
    if contact is None:
        words.append("no contact")
    elif len(trace.contacts) > 1:
        words.append(f"contact {trace.contact + 1} of {len(trace.contacts)}")
    if contact and math.isfinite(contact.peak_force):
        words.append(f"peak {number(contact.peak_force)} N")
    return words


def _seen(trace: Trace, row: Panel) -> ContactOutcome | None:
    return row.seen[trace.contact] if trace.contact >= 0 else None


def _late(trace: Trace, row: Panel) -> float:
    seen = _seen(trace, row)
    return seen.late if seen and seen.outcome == "detected" else math.inf


def _blind(trace: Trace, row: Panel) -> bool:
    seen = _seen(trace, row)
    return seen.outcome == "not_assessable" if seen else row.is_not_assessable
