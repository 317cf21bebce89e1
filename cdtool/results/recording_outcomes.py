"""The outcome of each recording with each detector, and its part in violated limits.

Conventions: a recording contributes to a violated limit if the limit counts one of its contacts or false alarms
(missed, false alarms, forces failed), or if one of them is beyond the limit (latencies, forces). A limit can be
violated without any such recording: the upper end of an interval may be beyond every single latency.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from cdtool.results.results import ContactResult, FalseAlarmResult, LimitResult, Results, grouped

# Figures of [limits] by what of a recording counts in them; in the others nothing of a single recording does.
MEANS = frozenset(("mean_ms", "mean_ms_upper"))
QUANTILES = frozenset(("median_ms", "median_ms_upper", "p95_ms", "p95_ms_upper", "max_ms"))
MISSES = frozenset(("missed", "missed_share", "missed_share_at_most"))
FALSE_ALARMS = frozenset(
    (
        "false_alarms",
        "false_alarms_per_hour",
        "false_alarms_per_hour_at_most",
        "false_alarms_per_operation",
        "false_alarms_per_operation_at_most",
    )
)
FORCES_AT_ALARM = frozenset(("force_at_alarm_n", "force_at_alarm_max_n"))


@dataclass(frozen=True)
class RecordingOutcome:
    """One recording and one detector: contacts, false alarms, and its part in violated limits in words.

    `judged` is False if the detector returned nothing for it: its contacts have no row, or it did not run in the group.
    """

    recording: str
    group: str
    detector: str
    contacts: tuple[ContactResult, ...]
    false_alarms: tuple[FalseAlarmResult, ...]
    breaks: tuple[str, ...]
    judged: bool

    @property
    def is_not_assessable(self) -> bool:
        """Whether the detector could not assess it."""
        unseen = bool(self.contacts) and all(item.outcome == "not_assessable" for item in self.contacts)
        return not self.judged or (unseen and not self.false_alarms)


def recording_outcomes(results: Results) -> Iterator[RecordingOutcome]:
    """Yield the outcome of every scored recording with every detector, group by group and detector by detector.

    Parameters
    ----------
    results : Results
        The results of a benchmark.

    Returns
    -------
    iterator of RecordingOutcome
        In the order of the benchmark file.

    Examples
    --------
    `cdtool.benchmark` returns the results.
    """
    contacts = grouped(results.contacts, "group", "recording", "detector")
    alarms = grouped(results.false_alarms, "group", "recording", "detector")
    true_contacts = {(item.group, item.recording): item.contacts for item in results.recordings}
    logs: dict[str, dict[str, None]] = {group: {} for group in results.every_group}
    for group, name, *_ in (*true_contacts, *contacts, *alarms):
        logs.setdefault(group, {})[name] = None
    ran = {(item.group, item.detector) for item in results.exposure}
    exceeded = grouped([item for item in results.limits if _exceeded(item)], "group", "detector")
    failed = {(item.group, item.recording, item.contact) for item in results.forces if item.verdict == "fail"}
    for group, names in logs.items():
        for detector in results.detectors:
            limits = exceeded.get((group, detector), [])
            for name in names:
                seen, false = contacts.get((group, name, detector), []), alarms.get((group, name, detector), [])
                breaks = tuple(words for limit in limits for words in _part_in(limit, seen, false, failed))
                silent = (group, detector) in ran and not true_contacts.get((group, name), 0)
                judged = bool(seen or false or silent)
                yield RecordingOutcome(name, group, detector, tuple(seen), tuple(false), breaks, judged)


def _exceeded(limit: LimitResult) -> bool:
    """Return whether a single recording can have violated a limit."""
    above = limit.largest is not None and (limit.value is None or limit.value > limit.largest)
    return limit.outcome == "violated" and above != (limit.figure == "detected")


def _part_in(
    limit: LimitResult,
    contacts: Sequence[ContactResult],
    false_alarms: Sequence[FalseAlarmResult],
    failed: set[tuple[str, str, int]],
) -> Iterator[str]:
    allows = f"at most {limit.largest:g}" if limit.figure != "detected" else f"at least {limit.least:g}"
    if limit.figure in FALSE_ALARMS:
        words = [f"false alarm at {item.time_s:.3f} s on {item.joint}" for item in false_alarms]
    else:
        fails = [(item.group, item.recording, item.contact) in failed for item in contacts]
        parts = [(item.contact, _beyond(limit, item, fail)) for item, fail in zip(contacts, fails, strict=True)]
        words = [f"contact {number} {part}" for number, part in parts if part]
    yield from (f"{item} ({limit.limit}: {allows})" for item in words)


def _beyond(limit: LimitResult, item: ContactResult, force_failed: bool) -> str:
    """Return how a contact exceeds what a limit allows; empty if it does not."""
    figure = limit.figure
    if item.outcome == "missed" and figure in MISSES | QUANTILES | {"detected"}:
        return "is missed"
    if item.outcome == "not_assessable" and figure in ("not_assessable", "detected"):
        return "is not assessable"
    if item.in_progress and figure == "in_progress":
        return "is in progress at the start"
    if item.clipped and figure == "clipped":
        return "has a negative latency, counted as 0"
    if figure == "force_failed":
        return "fails its force limits" if force_failed else ""
    value, words, unit = _measured(figure, item)
    above = value is not None and limit.largest is not None and value > limit.largest
    return f"{words} {value:.4g} {unit}" if above else ""


def _measured(figure: str, item: ContactResult) -> tuple[float | None, str, str]:
    """Return the value of a contact on which a metric is based, in words and with its unit."""
    if figure in MEANS | QUANTILES:
        return item.latency_ms, "is detected after", "ms"
    if figure in FORCES_AT_ALARM:
        return item.force_at_alarm_n, "has at its alarm", "N"
    return (item.peak_force_n if figure == "peak_force_n" else None), "has a peak of", "N"
