"""Results: every verdict of a benchmark with raw figures and provenance. Statistics are derived from it.

Conventions: times are seconds on the recording's own clock; None where there is no value. Each field is defined
together with its meaning, from which the published schema is made.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass
from functools import cache
from operator import attrgetter
from typing import Any, Literal, Self, TypeVar, get_args, get_origin, get_type_hints

from cdtool.base.findings import Finding

Row = TypeVar("Row")
# Of the layout of results.json: a change of it counts on.
SCHEMA_VERSION = 5
# How reports introduce what is lost of a recording that was used.
DAMAGED = "damaged, used as far as it goes"
_LOSS, _IN_PROGRESS = "loss", "in_progress"


def meant(meaning: str, **default: Any) -> Any:
    """A dataclass field with its meaning."""
    return field(metadata={"meaning": meaning}, **default)


@dataclass(frozen=True, slots=True)
class RecordingResult:
    """One log that was scored."""

    recording: str = meant("path of the log below the benchmark file")
    group: str = meant("the benchmark's group that it belongs to")
    sha256: str = meant("hash of the log")
    seconds: float = meant("from the first sample of any channel to the last")
    operations: int = meant("operations that it was cut into")
    contacts: int = meant("true contacts in it")
    campaign: str | None = meant("test campaign: recordings of one campaign are resampled together", default=None)
    point: str | None = meant("test point: its forces are averaged", default=None)
    began_s: float | None = meant(
        "first sample, in seconds since 1970-01-01 UTC; null: the log's clock does not count from there", default=None
    )


@dataclass(frozen=True, slots=True)
class ContactResult:
    """One contact seen by one detector."""

    recording: str = meant("path of the log below the benchmark file")
    group: str = meant("the benchmark's group")
    detector: str = meant("full name of the detector")
    joint: str | None = meant("joint whose alarm detected the contact")
    onset_s: float = meant("when the contact began; of one in progress at the start: the first sample")
    onset_uncertainty_s: float | None = meant("how much earlier it may have begun; null: in progress at the start")
    alarm_s: float | None = meant("time of the sample that raised the alarm, debounce included")
    latency_ms: float | None = meant(
        "alarm less onset; 0 where the alarm came within the onset's uncertainty before it"
    )
    outcome: Literal["detected", "missed", "not_assessable", "in_progress"] = meant(
        "detected, missed, not_assessable or in_progress (at the start: neither detected nor missed)"
    )
    force_at_alarm_n: float | None = meant(
        "magnitude of the load-cell force over its rest level: last sample at or before the alarm, or at the onset"
    )
    peak_force_n: float | None = meant("largest magnitude of the same force in the contact")
    clipped: bool = meant(
        "negative latency, counted as 0: the alarm came before the onset, within its uncertainty", default=False
    )
    reason: str | None = meant("why the contact could not be assessed, or is not scored", default=None)
    contact: int = meant("number of the contact in its recording, from 1", default=1)
    kind: str | None = meant("what a label file calls the contact", default=None)
    found_by: str = meant("ground truth: load cell, label, event or label file", default="load cell")
    watched_ms: float | None = meant("how long after the onset an alarm would have counted", default=None)
    resolution_ms: float | None = meant(
        "the latency is no finer than this: sample periods, synchronisation, noise, drift and slope of the force",
        default=None,
    )
    side: Literal["above", "below"] | None = meant(
        "the limit that was crossed: above or below; null for triggers of a program", default=None
    )
    statistic: float | None = meant("value compared with the limit at the alarm; null for triggers", default=None)
    limit: float | None = meant("limit at the alarm, in the unit of the statistic; null for triggers", default=None)
    rest_n: float | None = meant("what the load cell read at rest just before the onset", default=None)
    drift_n_per_s: float | None = meant("drift of that reading before the onset; 0: none beyond doubt", default=None)
    onset_hole_ms: float | None = meant(
        "how long load-cell samples are missing where the contact may have begun: the latency may be longer by "
        "onset_uncertainty_s; null: none are missing",
        default=None,
    )
    force_hole_ms: float | None = meant(
        "how long load-cell samples are missing at the onset or while the contact presses: the peak may be larger; "
        "null: none are missing",
        default=None,
    )

    @property
    def in_progress(self) -> bool:
        """Whether the contact was in progress when the recording began: it has no onset, and is not scored."""
        return self.outcome == _IN_PROGRESS


@dataclass(frozen=True, slots=True)
class FalseAlarmResult:
    """One alarm without a contact."""

    recording: str = meant("path of the log below the benchmark file")
    group: str = meant("the benchmark's group")
    detector: str = meant("full name of the detector")
    joint: str = meant("joint that raised it")
    time_s: float = meant("when")
    side: Literal["above", "below"] | None = meant("the limit that was crossed: above or below", default=None)
    statistic: float | None = meant("value compared with the limit, in the unit of provenance.units", default=None)
    limit: float | None = meant("limit, in the detector's unit", default=None)
    operation: int | None = meant(
        "number of the operation in its recording, from 1; null: read from a file of version 4 without it", default=None
    )


@dataclass(frozen=True, slots=True)
class ExposureResult:
    """How long and how often a detector monitored a group: the denominator of its false alarms."""

    group: str = meant("the benchmark's group")
    detector: str = meant("full name of the detector")
    recordings: int = meant("logs")
    operations: int = meant("operations")
    hours: float = meant("time in which the signal was assessable")
    not_assessable: int = meant("operations without an assessable sample", default=0)
    not_judged: Mapping[str, float] = meant("share of all samples by reason", default_factory=dict)  # language: data


@dataclass(frozen=True, slots=True)
class ConditionResult:
    """One group of recordings of the machine under a changed condition: it is scored, and counts nowhere else."""

    group: str = meant("name of the group in all rows: CONDITION/GROUP")
    condition: str = meant("name of the changed condition")
    counterpart: str = meant("group of the unchanged machine that it is compared with")
    impact_free: bool = meant("whether its recordings have no contacts")


@dataclass(frozen=True, slots=True)
class ForceStepResult:
    """One step of a force profile, compared with one contact or one test point."""

    name: str = meant("the step's name in the limits file")
    from_s: float = meant("from this long after the onset")
    at_most_n: float = meant("largest force allowed")
    peak_n: float | None = meant("largest force in the step; of a point: the mean of its tests, or the largest of them")
    time_budget_ms: float | None = meant("how long after the onset the limit was first exceeded; null if never")
    verdict: Literal["pass", "fail", "not_assessable"] = meant("pass, fail or not_assessable")
    reason: str | None = meant("why it does not pass", default=None)


@dataclass(frozen=True, slots=True)
class ForceResult:
    """One contact against a force profile."""

    recording: str = meant("path of the log below the benchmark file")
    group: str = meant("the benchmark's group")
    contact: int = meant("number of the contact in its recording, from 1")
    profile: str = meant("name of the profile in the limits file")
    verdict: Literal["pass", "fail", "not_assessable"] = meant("pass, fail or not_assessable")
    peak_n: float | None = meant("largest force of the contact, corrected for the mass before the cell")
    steps: tuple[ForceStepResult, ...] = meant("each step of the profile")
    point: str | None = meant("test point", default=None)
    time_budget_ms: float | None = meant(
        "when the first limit was exceeded, after the onset; null if never", default=None
    )
    reason: str | None = meant("why it does not pass", default=None)


@dataclass(frozen=True, slots=True)
class PointResult:
    """The tests at one point against a force profile, averaged as the profile asks."""

    point: str = meant("test point")
    group: str = meant("the benchmark's group")
    profile: str = meant("name of the profile in the limits file")
    tests: int = meant("contacts at the point")
    verdict: Literal["pass", "fail", "not_assessable"] = meant("pass, fail or not_assessable")
    steps: tuple[ForceStepResult, ...] = meant("each step of the profile")
    note: str = meant("how many tests were averaged")
    reason: str | None = meant("why it does not pass", default=None)


@dataclass(frozen=True, slots=True)
class SweepResult:
    """One detector in one group with all its limits moved: a point of the latency against false-alarm curve."""

    detector: str = meant("full name of the detector")
    group: str = meant("group of impacts")
    safety_factor: float = meant("limits' distance from the mean, in the threshold's unit of spread")
    false_alarms: int = meant("in the impact-free group")
    operations: int = meant("of the impact-free group")
    hours: float = meant("monitored in the impact-free group")
    detected: int = meant("contacts")
    missed: int = meant("contacts")
    not_assessable: int = meant("contacts")
    mean_ms: float | None = meant("latency of the detected contacts")
    median_ms: float | None = meant("of the latency, missed contacts taken as later than all; null where not reached")
    in_use: bool = meant("the benchmark's own limits", default=False)

    @property
    def median(self) -> float:
        """The median latency [ms]: infinite where it is not reached, NaN if no contact could be assessed."""
        if not self.detected and not self.missed:
            return math.nan
        return math.inf if self.median_ms is None else self.median_ms


@dataclass(frozen=True, slots=True)
class CalibrationResult:
    """How a detector's safety factor was set for a false-alarm budget."""

    detector: str = meant("full name of the detector")
    budget: str = meant("false alarms allowed")
    safety_factor: float = meant("the factor set")
    operations: int = meant("impact-free operations, each judged with a threshold that was not learned from it")
    hours: float = meant("monitored in them")
    alarms: int = meant("operations that alarm with that factor; of a budget by hour: alarms")


@dataclass(frozen=True, slots=True)
class LimitResult:
    """One limit of the benchmark file, checked against one metric."""

    limit: str = meant("key in [limits]")
    detector: str = meant("full name of the detector")
    group: str = meant("the benchmark's group; of one kind of contacts GROUP/KIND")
    figure: str = meant("name of the metric")
    value: float | None = meant("value of the metric; null where it is not known or not finite")
    least: float | None = meant("smallest value allowed")
    largest: float | None = meant("largest value allowed")
    outcome: Literal["met", "violated", "not_assessable"] = meant("met, violated or not_assessable")
    reason: str | None = meant("why it is not met", default=None)


@dataclass(frozen=True, slots=True)
class ConclusionResult:
    """What follows from limits, force profiles, missed contacts and what could not be assessed, taken together."""

    outcome: Literal["violated", "not_assessable", "met", "not_asked"] = meant(
        "violated, not_assessable, met, or not_asked without limits and force profiles", default="not_asked"
    )
    headline: str = meant("the conclusion in one line, as every report shows it", default="no limits are set")
    reasons: tuple[str, ...] = meant("what is not good beside the limits, line by line, worst first", default=())
    missed_without_limit: int = meant("missed detections that no limit covers", default=0)
    facts: tuple[str, ...] = meant("what decides the exit status", default=())
    exit_status: int = meant("exit status of the benchmark with these results", default=0)
    tone: str = meant("good, bad, unknown, or empty if nothing was required: that of the worst statement", default="")
    protocol: tuple[str, ...] = meant(
        "pass, fail or incomplete, the sentence and the reasons of the test protocol made with them; empty without one",
        default=(),
    )


@dataclass(frozen=True, slots=True)
class Skipped:
    """What was left out: a recording, a part of one, or a detector."""

    recording: str = meant("path of the log below the benchmark file, or a detector")
    reason: str = meant("why it was left out")


@dataclass(frozen=True, slots=True)
class RecordingFinding:
    """A finding about a recording, or a detector, that was used."""

    recording: str = meant("path of the log below the benchmark file, or a detector")
    reason: str = meant("the finding in words")
    severity: Literal["loss", "warning", "note"] = meant("loss, warning or note", default="warning")
    kind: str = meant("kind of the finding", default="")
    channel: str = meant("channel or topic that it is about; empty for the whole log", default="")

    @classmethod
    def of(cls, recording: str, finding: Finding) -> Self:
        """Return a finding under the name of its recording."""
        return cls(recording, str(finding), finding.severity, finding.kind, finding.channel)

    @property
    def is_loss(self) -> bool:
        """True where part of the recording is lost."""
        return self.severity == _LOSS


@dataclass(frozen=True, slots=True)
class Results:
    """All of it, in the order of the benchmark file."""

    provenance: Mapping[str, Any] = meant("tool, hashes, rules and gains that led to the results")
    detectors: tuple[str, ...] = meant("full names")
    groups: tuple[str, ...] = meant("groups of the unchanged machine: of impacts, then the impact-free hold-out")
    contacts: tuple[ContactResult, ...] = meant("one row per contact and detector")
    false_alarms: tuple[FalseAlarmResult, ...] = meant("one row per alarm without a contact")
    exposure: tuple[ExposureResult, ...] = meant("one row per group and detector")
    recordings: tuple[RecordingResult, ...] = meant("one row per log that was scored", default=())
    forces: tuple[ForceResult, ...] = meant("one row per contact with a force profile", default=())
    points: tuple[PointResult, ...] = meant("one row per test point with a force profile", default=())
    sweep: tuple[SweepResult, ...] = meant("latency against false alarms with all limits moved", default=())
    calibration: tuple[CalibrationResult, ...] = meant("safety factors set for a budget", default=())
    limits: tuple[LimitResult, ...] = meant("outcome of [limits]", default=())
    conditions: tuple[ConditionResult, ...] = meant("groups of the machine under changed conditions", default=())
    skipped: tuple[Skipped, ...] = meant("what was left out", default=())
    findings: tuple[RecordingFinding, ...] = meant("findings about recordings that were used", default=())
    conclusion: ConclusionResult = field(
        default_factory=ConclusionResult, metadata={"meaning": "the conclusion from all of it"}
    )
    schema_version: int = meant("version of this layout", default=SCHEMA_VERSION)

    @property
    def every_group(self) -> tuple[str, ...]:
        """The groups of the unchanged machine, then those of changed conditions."""
        return (*self.groups, *(item.group for item in self.conditions))

    @property
    def losses(self) -> list[RecordingFinding]:
        """The findings about recordings of which a part is lost."""
        return [item for item in self.findings if item.is_loss]

    @property
    def warnings(self) -> list[RecordingFinding]:
        """The other findings."""
        return [item for item in self.findings if not item.is_loss]

    @property
    def scored_contacts(self) -> list[ContactResult]:
        """The contacts that have an onset, and so a latency or a reason for none."""
        return [item for item in self.contacts if not item.in_progress]


def grouped(rows: Sequence[Row], *names: str) -> dict[Any, list[Row]]:
    """Return rows by the value of a field, or the values of several.

    Parameters
    ----------
    rows : sequence
        The rows.
    *names : str
        The fields.

    Returns
    -------
    dict of object to list
        The rows by the value, or by the values as a tuple, in the order of the first rows.

    Examples
    --------
    >>> grouped([Skipped("a", "empty"), Skipped("b", "empty")], "reason")["empty"][1].recording
    'b'
    """
    key = attrgetter(*names)
    found: dict[Any, list[Row]] = {}
    for row in rows:
        found.setdefault(key(row), []).append(row)
    return found


@cache
def tables() -> Mapping[str, Any]:
    """Return the class of the rows of each table; the tables are the fields of `Results` with rows.

    Returns
    -------
    mapping of str to type
        The class by the name of the field.

    Examples
    --------
    >>> list(tables())[:3]
    ['contacts', 'false_alarms', 'exposure']
    """
    hints = get_type_hints(Results)
    found = {item.name: get_args(hints[item.name]) for item in fields(Results)}
    return {name: inner[0] for name, inner in found.items() if inner and is_dataclass(inner[0])}


def scalar_of(hint: Any) -> type | None:
    """Return which plain values a field has.

    Parameters
    ----------
    hint : type
        The type of the field.

    Returns
    -------
    type or None
        str, float, int or bool, also where a value may be missing; None for any other field.

    Examples
    --------
    >>> scalar_of(float | None), scalar_of(Literal["above"]), scalar_of(tuple[float, ...])
    (<class 'float'>, <class 'str'>, None)
    """
    if type(None) in get_args(hint):
        (hint,) = (item for item in get_args(hint) if item is not type(None))
    if get_origin(hint) is Literal:
        return str
    return hint if hint in (str, float, int, bool) else None
