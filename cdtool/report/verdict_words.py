"""What a benchmark found, in one line, and what a limit says: the same words in every report."""

from __future__ import annotations

from cdtool.evaluation.evaluated import Evaluated
from cdtool.evaluation.results import LimitResult
from cdtool.plain_text import counted
from cdtool.report.number_text import NOT_ASSESSABLE, NOT_REACHED, NOTHING

NO_CERTIFICATE = "This is evidence from recordings, not a certificate of safety."


def verdict_words(evaluated: Evaluated) -> str:
    """Limits, force profiles, missed contacts and what could not be assessed, in one line."""
    return evaluated.results.conclusion.headline


def tone(evaluated: Evaluated) -> str:
    """Whether that line is good, bad or unknown; empty where nothing was asked for."""
    conclusion = evaluated.results.conclusion
    if conclusion.outcome == "violated":
        return "bad"
    if conclusion.outcome == "not_assessable" or conclusion.missed_without_limit:
        return "unknown"
    return "good" if conclusion.outcome == "met" else ""


def counts_words(evaluated: Evaluated) -> str:
    """What became of the contacts, over all detectors and groups."""
    summaries, results = evaluated.summaries, evaluated.results
    if not any(item.contacts or item.operations for item in summaries):
        return "nothing was scored"
    contacts = len({(item.group, item.recording, item.contact) for item in results.scored_contacts})
    counts = (
        ("detected", sum(item.detected for item in summaries)),
        ("missed", sum(item.missed for item in summaries)),
        ("not assessable", sum(item.not_assessable for item in summaries)),
    )
    became = ", ".join(f"{count} {what}" for what, count in counts)
    if negative := sum(item.clipped for item in summaries):
        became += f" ({negative} before the onset, counted as 0 ms)"
    if unseen := len(
        {(item.group, item.recording, item.contact) for item in results.contacts if item.onset_hole_ms is not None}
    ):
        became += f"; {counted(unseen, 'contact')} may have begun where load-cell samples are missing"
    if begun := len({(item.group, item.recording, item.contact) for item in results.contacts if item.in_progress}):
        became += f"; {counted(begun, 'contact')} in progress at the start, not scored"
    watched = any(item.watched and item.judged_operations for item in summaries)
    count = counted(sum(item.false_alarms for item in summaries), "false alarm")
    alarms = count if watched else f"false alarms {NOT_ASSESSABLE}"
    return f"{counted(contacts, 'contact')} with {counted(len(results.detectors), 'detector')}: {became}; {alarms}"


def value_of(limit: LimitResult) -> str:
    """A limit's figure; one that was checked and has no number is infinite, in as many digits as its reason."""
    if limit.value is None:
        return NOTHING if limit.outcome == "not_assessable" else NOT_REACHED
    return f"{limit.value:.6g}"


def allowed(limit: LimitResult) -> str:
    """What a limit allows, as it was written."""
    least, largest = limit.least, limit.largest
    if least is not None and largest is not None:
        return f"{least:.6g} to {largest:.6g}"
    if largest is not None:
        return f"at most {largest:.6g}"
    return NOTHING if least is None else f"at least {least:.6g}"
