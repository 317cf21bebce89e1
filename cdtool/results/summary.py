"""Statistics of the outcomes of one detector in one group, each figure with its interval; undefined = NaN, never zero.

Mean and standard deviation describe only the detected contacts and must be read together with n, missed, not assessable
and false alarms: a detector that misses its slow cases looks fast. Median and P95 treat missed contacts as censored.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cdtool.base.plain_text import counted
from cdtool.results.results import ContactResult, ExposureResult, FalseAlarmResult, ForceResult, Results, grouped
from cdtool.statistics.interval import Interval
from cdtool.statistics.rates import binomial_at_most, binomial_share, poisson_at_most, poisson_rate
from cdtool.statistics.small_sample import FEWEST, median_of, p95_of
from cdtool.statistics.spread import mean_interval


@dataclass(frozen=True)
class Summary:
    """Latency [ms] over the contacts, shares, rates, and the counts to read them with; intervals at 95 %.

    `mean`, `std_ms`: of the detected contacts; Student's interval by recording or campaign. `median`, `p95`:
    Kaplan-Meier. Where there are too few contacts or recordings for an interval it is NaN, with its reason (see
    `small_sample`). `missed_share` is of the assessable contacts; "at most" is its one-sided bound, and that of the
    false alarms. `force_at_alarm` and `peak_force` [N] are medians, of the detected and of all contacts; a missed
    contact makes the largest force at the alarm infinite. `judged_operations` are those assessable at least in part:
    the false alarms are of these. `clipped` of the detected contacts have a negative latency, counted as 0.
    `in_progress` contacts are not among `contacts`: they had begun when the recording did. `onset_holes` of the
    contacts may have begun where load-cell samples are missing: their latencies may be up to `later_ms` longer. In
    `force_holes` the peak may be unseen.
    `alarming` of the operations have a false alarm. `resolution_ms`: no latency is finer than this; None if unknown.
    """

    detector: str
    group: str
    contacts: int
    detected: int
    missed: int
    not_assessable: int
    mean: Interval
    std_ms: float
    median: Interval
    p95: Interval
    min_ms: float
    max_ms: float
    missed_share: Interval
    missed_at_most: float
    false_alarms: int
    operations: int
    judged_operations: int
    hours: float
    false_alarms_per_hour: Interval
    false_alarms_per_operation: Interval
    at_most_per_hour: float
    at_most_per_operation: float
    force_at_alarm: float
    force_at_alarm_max: float
    peak_force: float
    force_failed: float
    clipped: int = 0
    in_progress: int = 0
    onset_holes: int = 0
    later_ms: float = 0.0
    force_holes: int = 0
    alarming: int = 0
    resolution_ms: float | None = None

    @property
    def watched(self) -> bool:
        """Whether anything was assessable: otherwise the absence of false alarms means nothing."""
        return self.hours > 0.0

    @property
    def few(self) -> bool:
        """Whether fewer than ten contacts were detected: tables then show median and range, no mean, std or P95."""
        return self.detected < FEWEST

    @property
    def assessable(self) -> int:
        """Contacts that could be assessed."""
        return self.contacts - self.not_assessable

    @property
    def mean_ms(self) -> float:
        """Mean latency of the detected contacts [ms]."""
        return self.mean.value

    @property
    def median_ms(self) -> float:
        """Median latency [ms], missed contacts taken as censored."""
        return self.median.value

    def why_undefined(self, figure: str) -> str:
        """Why a figure of this summary is NaN."""
        if figure in COUNTED_ALWAYS:
            return "nothing was monitored"
        if not self.contacts and self.in_progress:
            return f"{counted(self.in_progress, 'contact', 'were')} in progress when the recording began"
        if not self.contacts:
            return "no recording of the group was scored"
        if self.contacts == self.not_assessable:
            return f"none of {self.contacts} contacts could be assessed"
        if figure == "force_failed":
            return "no contact was compared with a force profile, or not all of them could be assessed"
        if "force" in figure:
            return "no load-cell force at an alarm"
        interval = {"mean_ms_upper": self.mean, "median_ms_upper": self.median, "p95_ms_upper": self.p95}.get(figure)
        if interval and interval.reason:
            return interval.reason
        return f"{self.detected} of {self.contacts} contacts detected: too few for this limit"


# What [limits] and reports may ask of a summary.
FIGURES: Mapping[str, Callable[[Summary], float]] = {
    "mean_ms": lambda item: item.mean.value,
    "mean_ms_upper": lambda item: item.mean.high,
    "std_ms": lambda item: item.std_ms,
    "median_ms": lambda item: item.median.value,
    "median_ms_upper": lambda item: item.median.high,
    "p95_ms": lambda item: item.p95.value,
    "p95_ms_upper": lambda item: item.p95.high,
    "max_ms": lambda item: item.max_ms,
    "contacts": lambda item: item.contacts,
    "detected": lambda item: item.detected if item.assessable else math.nan,
    "missed": lambda item: item.missed if item.assessable else math.nan,
    "missed_share": lambda item: item.missed_share.value,
    "missed_share_at_most": lambda item: item.missed_at_most,
    "not_assessable": lambda item: item.not_assessable,
    "false_alarms": lambda item: item.false_alarms if item.watched else math.nan,
    "false_alarms_per_hour": lambda item: item.false_alarms_per_hour.value,
    "false_alarms_per_hour_at_most": lambda item: item.at_most_per_hour,
    "false_alarms_per_operation": lambda item: item.false_alarms_per_operation.value,
    "false_alarms_per_operation_at_most": lambda item: item.at_most_per_operation,
    "operations": lambda item: item.judged_operations,
    "hours": lambda item: item.hours,
    "force_at_alarm_n": lambda item: item.force_at_alarm,
    "force_at_alarm_max_n": lambda item: item.force_at_alarm_max,
    "peak_force_n": lambda item: item.peak_force,
    "clipped": lambda item: item.clipped if item.assessable else math.nan,
    "in_progress": lambda item: item.in_progress,
    "force_failed": lambda item: item.force_failed,
}
# Figures that a group without contacts has too.
COUNTED_ALWAYS = frozenset(
    name for name in FIGURES if name.startswith("false_alarms") or name in ("operations", "hours", "in_progress")
)


def summarise(results: Results) -> list[Summary]:
    """Return one Summary for each detector and group, in the order of the benchmark file; hold-out last."""
    return _summaries(results, results.groups)


def summarise_conditions(results: Results) -> list[Summary]:
    """Return one Summary for each detector and group of a changed condition, in the order of the benchmark file."""
    return _summaries(results, [item.group for item in results.conditions])


def _summaries(results: Results, groups: Sequence[str]) -> list[Summary]:
    contacts = grouped(results.contacts, "detector", "group")
    forces = {group: _failed(items) for group, items in grouped(results.forces, "group").items()}
    alarms = grouped(results.false_alarms, "detector", "group")
    exposures = {(item.detector, item.group): item for item in results.exposure}
    clusters = campaigns(results)
    return [
        _summary(
            detector,
            group,
            contacts.get((detector, group), ()),
            alarms.get((detector, group), ()),
            exposures.get((detector, group)),
            clusters,
            forces.get(group, math.nan),
        )
        for group in groups
        for detector in results.detectors
    ]


def kind_group(group: str, kind: str) -> str:
    """Return the name under which statistics of one kind of contacts are shown and limited.

    Parameters
    ----------
    group, kind : str
        The benchmark's group, and what the label file calls the contacts; empty for those without a kind.

    Returns
    -------
    str
        The name.

    Examples
    --------
    >>> kind_group("stiff", "head"), kind_group("stiff", "")
    ('stiff/head', 'stiff/(no kind)')
    """
    return f"{group}/{kind or '(no kind)'}"


def summarise_kinds(results: Results) -> list[Summary]:
    """Return one Summary for each detector, group and kind of contact, under the name of `kind_group`.

    Parameters
    ----------
    results : Results
        The results of a benchmark.

    Returns
    -------
    list of Summary
        Empty if no contact has a kind. Groups without kinds are left out. False alarms belong to no kind: a summary has
        neither them nor operations.

    Examples
    --------
    `evaluate` adds them to the results.
    """
    clusters = campaigns(results)
    contacts, forces = grouped(results.contacts, "group"), grouped(results.forces, "group")
    made = []
    for group in results.groups:
        kinds = grouped(contacts.get(group, ()), "kind")
        for kind, rows in kinds.items() if any(kinds) else ():
            numbers = {(item.recording, item.contact) for item in rows}
            failed = _failed([item for item in forces.get(group, ()) if (item.recording, item.contact) in numbers])
            of_detector = grouped(rows, "detector")
            for name in results.detectors:
                items = of_detector.get(name, ())
                made.append(_summary(name, kind_group(group, kind or ""), items, (), None, clusters, failed))
    return made


def later_ms(item: ContactResult) -> float:
    """Return how much longer the latency of a contact may be, because load-cell samples are missing where it began.

    Parameters
    ----------
    item : ContactResult
        The row of the contact.

    Returns
    -------
    float
        The time [ms]; 0 if no sample is missing.

    Examples
    --------
    `cdtool.benchmark` returns the rows.
    """
    if item.onset_hole_ms is None:
        return 0.0
    before = 1e3 * (item.onset_uncertainty_s or 0.0)
    if not item.clipped or item.alarm_s is None:
        return before
    return max(1e3 * (item.alarm_s - item.onset_s) + before, 0.0)


def at_worst(results: Results) -> Results:
    """Return the results with the longest latencies and the largest forces that missing load-cell samples allow."""
    return replace(results, contacts=tuple(map(_at_worst, results.contacts)))


def _at_worst(item: ContactResult) -> ContactResult:
    if item.force_hole_ms is None and item.onset_hole_ms is None:
        return item
    late, at_alarm = item.latency_ms, item.force_at_alarm_n
    return replace(
        item,
        latency_ms=None if late is None else late + later_ms(item),
        force_at_alarm_n=math.inf if late is not None and at_alarm is None else at_alarm,
        peak_force_n=math.inf,
    )


def campaigns(results: Results) -> dict[str, str]:
    """Return with what each recording is resampled.

    Parameters
    ----------
    results : Results
        The results of a benchmark.

    Returns
    -------
    dict of str to str
        For each recording its campaign if it has one, else the recording itself.

    Examples
    --------
    `cdtool.benchmark` returns the results.
    """
    return {item.recording: item.campaign or item.recording for item in results.recordings}


def latencies(contacts: Sequence[ContactResult]) -> tuple[np.ndarray, np.ndarray]:
    """Return the latency of every assessable contact, and whether it is censored.

    Parameters
    ----------
    contacts : sequence of ContactResult
        The rows of the contacts.

    Returns
    -------
    latency : ndarray of float, shape (n,)
        Latency [ms]; of a missed contact the time for which it was monitored.
    censored : ndarray of bool, shape (n,)
        True if the contact was missed.

    Examples
    --------
    `latency_quantile` takes both.
    """
    seen = [item for item in contacts if item.outcome in ("detected", "missed")]
    values = [item.latency_ms if item.latency_ms is not None else item.watched_ms or 0.0 for item in seen]
    return np.array(values, dtype=np.float64), np.array([item.outcome == "missed" for item in seen], dtype=bool)


def _summary(
    detector: str,
    group: str,
    contacts: Sequence[ContactResult],
    alarms: Sequence[FalseAlarmResult],
    exposure: ExposureResult | None,
    clusters: Mapping[str, str],
    force_failed: float,
) -> Summary:
    in_progress = sum(item.in_progress for item in contacts)
    contacts = [item for item in contacts if not item.in_progress]
    detected = [item for item in contacts if item.latency_ms is not None]
    values = np.array([item.latency_ms for item in detected], dtype=np.float64)
    labels = [clusters.get(item.recording, item.recording) for item in detected]
    latency, censored = latencies(contacts)
    seen = [clusters.get(item.recording, item.recording) for item in contacts if item.outcome != "not_assessable"]
    missed = int(censored.sum())
    false_alarms = len(alarms)
    operations, hours = (exposure.operations, exposure.hours) if exposure else (0, 0.0)
    judged = operations - exposure.not_assessable if exposure else 0
    at_alarm = [item.force_at_alarm_n for item in detected if item.force_at_alarm_n is not None]
    peaks = [item.peak_force_n for item in contacts if item.peak_force_n is not None]
    return Summary(
        detector=detector,
        group=group,
        contacts=len(contacts),
        detected=len(values),
        missed=missed,
        not_assessable=len(contacts) - len(latency),
        mean=mean_interval(values, labels),
        std_ms=float(np.std(values - values[0], ddof=1)) if len(values) > 1 else math.nan,
        median=median_of(latency, censored, seen),
        p95=p95_of(latency, censored, seen),
        min_ms=float(values.min()) if len(values) else (math.inf if missed else math.nan),
        max_ms=float(values.max()) if len(values) and not missed else (math.inf if missed else math.nan),
        missed_share=binomial_share(missed, len(latency)),
        missed_at_most=binomial_at_most(missed, len(latency)) if len(latency) else math.nan,
        false_alarms=false_alarms,
        operations=operations,
        judged_operations=judged,
        hours=hours,
        false_alarms_per_hour=poisson_rate(false_alarms, hours),
        false_alarms_per_operation=poisson_rate(false_alarms, float(judged)),
        at_most_per_hour=poisson_at_most(false_alarms, hours) if hours else math.nan,
        at_most_per_operation=poisson_at_most(false_alarms, float(judged)) if judged else math.nan,
        force_at_alarm=float(np.median(at_alarm)) if at_alarm else math.nan,
        force_at_alarm_max=math.inf if at_alarm and missed else max(at_alarm, default=math.nan),
        peak_force=float(np.median(peaks)) if peaks else math.nan,
        force_failed=force_failed,
        clipped=sum(item.clipped for item in detected),
        in_progress=in_progress,
        onset_holes=sum(item.onset_hole_ms is not None for item in contacts),
        later_ms=max((later_ms(item) for item in detected), default=0.0),
        force_holes=sum(item.force_hole_ms is not None for item in contacts),
        alarming=len({(item.recording, item.operation) for item in alarms}),
        resolution_ms=max((item.resolution_ms for item in contacts if item.resolution_ms), default=None),
    )


def _failed(forces: Sequence[ForceResult]) -> float:
    """Contacts above their force limits; NaN where none was judged, or none failed and one could not be assessed."""
    verdicts = Counter(item.verdict for item in forces)
    failed, unknown = verdicts["fail"], verdicts["not_assessable"]
    return math.nan if not verdicts or (unknown and not failed) else float(failed)
