"""`cdtool identify --by`: one identification per machine or day, and which parameters changed over time."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from enum import Enum
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import CdtoolError, UsageError
from cdtool.base.log_names import log_stem
from cdtool.base.remote.remote_path import location
from cdtool.commands.identify.estimate import IdentificationError
from cdtool.commands.identify.identifying import IdentifiedMachine, identify
from cdtool.commands.identify.joint import JointIdentification
from cdtool.commands.judging.log_groups import by_machine, day_in_path, day_of
from cdtool.commands.judging.runs import find_logs, read, several_logs, shown_path
from cdtool.execution.workers import Progress, Workers, in_order
from cdtool.formats.machine_file import MachineFile, read_machine_file
from cdtool.results.results import RecordingFinding, Skipped

# By machine, the logs of a machine are divided in their order into periods of at least so many logs, at most so many.
_LOGS_PER_PERIOD, _MOST_PERIODS = 5, 8
# A change is one beyond so many standard errors.
CHANGED_BEYOND = 3.0
# A standard error below this share of the value is not believed: a change that small matters to no detector.
_SMALLEST_ERROR = 1e-3
# Friction at the speed of the logs is compared if these speeds differ by at most this ratio.
_SAME_SPEED = 1.1


class Division(Enum):
    """How the logs of a fleet are divided: a machine's logs in their order, or each of its days."""

    MACHINE = "machine"
    DAY = "day"


class DriftKind(Enum):
    """What a parameter does over the periods of a machine."""

    NONE = "no change beyond 3 standard errors"
    TREND = "a change from the first period to the last"
    PERIOD = "one period differs from the others"
    ONE_PERIOD = "not assessable: only one period"
    OTHER_SPEED = "not assessable: the periods have other speeds"


@dataclass(frozen=True)
class Drift:
    """The change of a parameter: `change` in its unit, and how many `standard_errors` that is.

    Of a trend it is that of the regression line from the first period to the last, whose ends are `line`; otherwise the
    largest difference of one period from the mean of the others. NaN if it is not assessable.
    """

    kind: DriftKind
    change: float = math.nan
    standard_errors: float = math.nan
    line: tuple[float, float] = (math.nan, math.nan)

    @property
    def is_changed(self) -> bool:
        """Whether the parameter changed beyond 3 standard errors."""
        return self.kind in (DriftKind.TREND, DriftKind.PERIOD)


@dataclass(frozen=True)
class ParameterValue:
    """An identified value with its standard error; `speed` [m/s, rad/s] of a friction at that speed, else NaN."""

    name: str
    value: float
    standard_error: float
    unit: str
    method: str
    speed: float = math.nan


@dataclass(frozen=True)
class ParameterSeries:
    """A parameter over the periods of one machine in which it could be identified."""

    name: str
    unit: str
    periods: tuple[str, ...]
    values: tuple[float, ...]
    standard_errors: tuple[float, ...]
    drift: Drift


@dataclass(frozen=True)
class FleetMachine:
    """One machine: its parameters from all of its logs, and their series over its periods."""

    machine: str
    logs: int
    parameters: tuple[ParameterValue, ...]
    series: tuple[ParameterSeries, ...]

    @property
    def changed(self) -> tuple[ParameterSeries, ...]:
        """Return the parameters that changed beyond 3 standard errors."""
        return tuple(item for item in self.series if item.drift.is_changed)


@dataclass(frozen=True)
class FleetIdentification:
    """The identification of a fleet; `skipped` machines, periods and logs have their reason."""

    by: Division
    machines: tuple[FleetMachine, ...]
    skipped: tuple[Skipped, ...]
    findings: tuple[RecordingFinding, ...]

    @property
    def summary(self) -> dict[str, Any]:
        """Return all of it as JSON values."""
        return {
            "tool": "cdtool identify",
            "by": self.by.value,
            "machines": [
                {
                    "machine": item.machine,
                    "logs": item.logs,
                    "parameters": [asdict(value) for value in item.parameters],
                    "series": [_series_summary(series) for series in item.series],
                }
                for item in self.machines
            ],
            "skipped": [asdict(item) for item in self.skipped],
            "findings": [asdict(item) for item in self.findings],
        }


def _series_summary(series: ParameterSeries) -> dict[str, Any]:
    drift = {**asdict(series.drift), "kind": series.drift.kind.name.lower(), "is_changed": series.drift.is_changed}
    return {**asdict(series), "drift": drift}


@dataclass(frozen=True)
class _Group:
    """The logs of a machine, or of one of its periods (`period` is empty for all of them)."""

    machine: str
    period: str
    logs: tuple[Path, ...]


@dataclass(frozen=True)
class _GroupOutcome:
    """What a group's logs show, or the reason why they show nothing."""

    group: _Group
    parameters: tuple[ParameterValue, ...] = ()
    skipped: tuple[Skipped, ...] = ()
    findings: tuple[RecordingFinding, ...] = ()
    reason: str = ""


def identify_fleet(
    logs: Sequence[str | Path],
    machine: str | Path,
    by: Division = Division.MACHINE,
    *,
    workers: Workers | None = None,
    progress: Progress | None = None,
) -> FleetIdentification:
    """Identify each machine of a fleet, and its parameters over time.

    Parameters
    ----------
    logs : sequence of str or Path
        Impact-free logs. The first folder in which their paths differ, dates apart, names the machine.
    machine : str or Path
        The machine file of all of them.
    by : Division
        MACHINE: the logs of a machine in their order are divided into up to 8 periods of at least 5 logs. DAY: each day
        of a machine is a period; the day is the date in the log's path, or that of its clock (UTC).
    workers : Workers, optional
        Who identifies the machines and periods.
    progress : callable, optional
        Called after each identification with the number done and the total.

    Returns
    -------
    FleetIdentification
        Per machine the parameters from all logs, and per parameter its series with the change over time.

    Raises
    ------
    IdentificationError
        No machine can be identified.
    ConfigurationError
        The machine file is wrong, or no log matches.
    UsageError
        No log has a day.

    Notes
    -----
    The standard errors contain the friction along the track, which is the same in all periods of a machine: they are
    too large for differences. A change may therefore be missed rather than claimed. Friction also depends on what is
    not logged, as temperature: a change of the machine is not proven by one of its parameters.
    """
    machine_file = read_machine_file(location(machine))
    paths = find_logs(map(str, several_logs(logs)), Path(), "LOGS")
    named = by_machine(paths, machine_file.machine.name)
    skipped: list[Skipped] = []
    if by is Division.DAY:
        groups = _by_day(named, machine_file, skipped)
    else:
        groups = [_Group(name, period, part) for name, some in named.items() for period, part in _periods(some)]
    whole = [_Group(name, "", tuple(some)) for name, some in named.items()]
    items = [*whole, *(group for group in groups if len(group.logs) < len(named[group.machine]))]
    work = _IdentifiesGroup(location(machine))
    done = list(in_order(work, items, len(items), workers, progress=progress, of_lost=_lost))
    return _collected(by, done, skipped)


@dataclass(frozen=True)
class _IdentifiesGroup:
    """Identifies a machine from the logs of a group; an error is its outcome."""

    machine: Path

    def __call__(self, group: _Group) -> _GroupOutcome:
        try:
            done = identify(group.logs, self.machine)
        except CdtoolError as fault:
            return _GroupOutcome(group, reason=str(fault))
        return _GroupOutcome(group, tuple(parameters_of(done)), done.skipped, done.findings)


def _lost(group: _Group, reason: str) -> _GroupOutcome:
    return _GroupOutcome(group, reason=reason)


def _collected(by: Division, outcomes: Sequence[_GroupOutcome], skipped: list[Skipped]) -> FleetIdentification:
    machines: list[FleetMachine] = []
    findings: list[RecordingFinding] = []
    usable = {item.group.machine for item in outcomes if not item.group.period and not item.reason}
    for item in outcomes:
        if not item.group.period:
            skipped += item.skipped
            findings += item.findings
        if item.reason and (not item.group.period or item.group.machine in usable):
            name = " ".join(part for part in (item.group.machine, item.group.period) if part)
            skipped.append(Skipped(name, item.reason))
    for item in outcomes:
        if item.group.period or item.reason:
            continue
        periods = [other for other in outcomes if other.group.machine == item.group.machine and other.group.period]
        series = _series(periods or [item])
        machines.append(FleetMachine(item.group.machine, len(item.group.logs), item.parameters, series))
    if not machines:
        reasons = dict.fromkeys(item.reason for item in outcomes if item.reason)
        raise IdentificationError(f"no machine can be identified: {'; '.join(reasons)}", "see docs/identification.md")
    return FleetIdentification(by, tuple(machines), tuple(dict.fromkeys(skipped)), tuple(dict.fromkeys(findings)))


def parameters_of(done: IdentifiedMachine) -> Iterable[ParameterValue]:
    """Yield what can be compared between identifications: values that are identifiable alone, with standard errors.

    The friction at the speed of the logs is identifiable from one speed, its parts are not: it is here too.
    """
    for joint in done.joints:
        prefix = f"{joint.joint}: " if len(done.joints) > 1 else ""
        for item in joint.estimates:
            if math.isfinite(item.standard_error):
                name = f"{prefix}{item.section}.{item.key}"
                yield ParameterValue(name, item.value, item.standard_error, item.unit, item.method.value)
        yield from _frictions(joint, prefix)


def _frictions(joint: JointIdentification, prefix: str) -> Iterable[ParameterValue]:
    for level in joint.rigid.levels if joint.rigid else ():
        if math.isfinite(level.standard_error):
            name = f"{prefix}friction {'forward' if level.direction > 0 else 'backward'}"
            yield ParameterValue(
                name, level.force, level.standard_error, joint.units[1], "mean over the travel", level.speed
            )


def _series(periods: Sequence[_GroupOutcome]) -> tuple[ParameterSeries, ...]:
    """Return each parameter over the periods; a value by another method is another parameter."""
    found: dict[tuple[str, str], list[tuple[str, ParameterValue]]] = {}
    for outcome in periods:
        for value in outcome.parameters:
            found.setdefault((value.name, value.method), []).append((outcome.group.period or "all logs", value))
    series = []
    for (name, _), items in found.items():
        values = [item for _, item in items]
        numbers = np.array([item.value for item in values])
        errors = np.array([item.standard_error for item in values])
        speeds = np.array([item.speed for item in values])
        is_other = bool(np.isfinite(speeds).all() and speeds.max() > _SAME_SPEED * speeds.min())
        drift = Drift(DriftKind.OTHER_SPEED) if is_other and len(values) > 1 else drift_of(numbers, errors)
        names = tuple(period for period, _ in items)
        series.append(ParameterSeries(name, values[0].unit, names, tuple(numbers), tuple(errors), drift))
    return tuple(series)


def drift_of(values: FloatArray, standard_errors: FloatArray) -> Drift:
    """Return how a parameter changes over consecutive periods.

    Parameters
    ----------
    values, standard_errors : ndarray, shape (n,)
        Of each period, in order. A standard error below the median of all, or below 0.1 % of the value, is raised to
        that: from few strokes it can be far too small by chance.

    Returns
    -------
    Drift
        A trend if the weighted regression line changes by more than 3 of its standard errors; else one period, if it
        differs from the weighted mean of the others by more than as many standard errors as a normal variable exceeds
        with the same probability in one of n trials.

    Examples
    --------
    >>> import numpy as np
    >>> drift_of(np.array([200.0, 210.0, 221.0]), np.full(3, 2.0)).kind.name
    'TREND'
    >>> drift_of(np.array([200.0, 203.0, 199.0]), np.full(3, 2.0)).kind.name
    'NONE'
    """
    count = len(values)
    if count < 2:
        return Drift(DriftKind.ONE_PERIOD)
    smallest = _SMALLEST_ERROR * float(np.median(np.abs(values)))
    errors = np.maximum(standard_errors, max(float(np.median(standard_errors)), smallest, 1e-300))
    weights = errors**-2.0
    at = np.arange(count, dtype=np.float64)
    centre, mean = float(np.average(at, weights=weights)), float(np.average(values, weights=weights))
    spread = float(weights @ (at - centre) ** 2)
    slope = float(weights @ ((at - centre) * (values - mean))) / spread
    change, ratio = slope * (count - 1), abs(slope) * math.sqrt(spread)
    line = (mean - slope * centre, mean + slope * (count - 1 - centre))
    if ratio > CHANGED_BEYOND:
        return Drift(DriftKind.TREND, change, ratio, line)
    if count == 2:
        return Drift(DriftKind.NONE, change, ratio, line)
    return _odd_period(values, weights, change, ratio, line)


def _odd_period(
    values: FloatArray, weights: FloatArray, change: float, ratio: float, line: tuple[float, float]
) -> Drift:
    """Return the drift that one period shows, or none with the trend that was not significant."""
    from scipy.stats import norm

    total = float(np.sum(weights))
    others = (total * float(np.average(values, weights=weights)) - weights * values) / (total - weights)
    differences = values - others
    ratios = np.abs(differences) / np.sqrt(1.0 / weights + 1.0 / (total - weights))
    worst = int(np.argmax(ratios))
    beyond = -float(norm.ppf(float(norm.sf(CHANGED_BEYOND)) / len(values)))
    if ratios[worst] > beyond:
        level = float(others[worst])
        return Drift(DriftKind.PERIOD, float(differences[worst]), float(ratios[worst]), (level, level))
    return Drift(DriftKind.NONE, change, ratio, line)


def _periods(logs: Sequence[Path]) -> list[tuple[str, tuple[Path, ...]]]:
    """Return a machine's logs in their order as periods, each named by its first log and its last."""
    count = min(len(logs) // _LOGS_PER_PERIOD, _MOST_PERIODS)
    if count < 2:
        return []
    edges = [round(number * len(logs) / count) for number in range(count + 1)]
    parts = [tuple(logs[first:end]) for first, end in pairwise(edges)]
    return [(f"{log_stem(part[0])} to {log_stem(part[-1])}", part) for part in parts]


def _by_day(named: Mapping[str, Sequence[Path]], machine_file: MachineFile, skipped: list[Skipped]) -> list[_Group]:
    """Return the logs of each machine and day; a log without a day is left out of the periods."""
    groups = []
    for name, logs in named.items():
        days: dict[str, list[Path]] = {}
        for log in logs:
            day = _day_of(log, machine_file)
            if day:
                days.setdefault(day, []).append(log)
            else:
                skipped.append(Skipped(shown_path(log), "neither its path nor its clock contains a date"))
        groups += [_Group(name, day, tuple(days[day])) for day in sorted(days)]
    if not groups:
        raise UsageError(
            "--by day: neither the paths nor the clocks of the logs contain a date",
            "put the date into the folder or file name as 2026-11-27, or use --by machine",
        )
    return groups


def _day_of(log: Path, machine_file: MachineFile) -> str:
    if day := day_in_path(log):
        return day
    try:
        return day_of(log, read(log, machine_file).began)
    except CdtoolError:
        return ""
