"""Where a machine notices a contact, how soon and at which force: latency over position and stiffness, per detector."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np

from cdtool.results.agreement import with_model_error
from cdtool.results.limits import ALL, LimitRule
from cdtool.results.results import ContactResult

_DETECTED, _MISSED = "detected", "missed"
# A limit of one of these is a limit of the latencies in a cell.
_OF_LATENCY = ("mean_ms", "mean_ms_upper", "median_ms", "median_ms_upper", "p95_ms", "p95_ms_upper", "max_ms")


@dataclass(frozen=True)
class CellKey:
    """A cell of the map: position along the travel in its unit, stiffness of the obstacle [N/m].

    `speed`: median contact speed of its class of logs, None where all logs have about the same.
    """

    position: float
    stiffness: float
    speed: float | None = None


@dataclass(frozen=True)
class CellContact:
    """One contact of a cell: its recording, outcome, latency [ms] and force at the alarm [N], NaN if unknown."""

    recording: str
    outcome: str
    latency_ms: float
    force_n: float
    assumption: str
    speed: float
    reliable: bool

    @property
    def is_missed(self) -> bool:
        """Whether no alarm belongs to the contact."""
        return self.outcome == _MISSED


@dataclass(frozen=True)
class MapCell:
    """The contacts of one cell: their number, those missed and not assessable, and the outcome of the others.

    `latency_ms`: mean of the detected contacts, `standard_error_ms` of it from log to log (NaN below two), `range_ms`:
    least and greatest mean of the assumptions about what is not known, equal to the mean if all is known.
    `force_n`: median force at the alarm. `unreliable`: detected later than the injected contact is reliable.
    `limit_ms`: the lowest limit that the benchmark file sets for these latencies. `recordings`: missed contacts first,
    then from the slowest to the fastest.
    """

    contacts: int
    missed: int
    not_assessable: int
    latency_ms: float
    standard_error_ms: float
    range_ms: tuple[float, float]
    force_n: float
    unreliable: int
    limit_ms: float | None = None
    recordings: tuple[CellContact, ...] = ()

    @property
    def assessable(self) -> int:
        """Return the number of contacts that are detected or missed."""
        return self.contacts - self.not_assessable

    @property
    def misses_most(self) -> bool:
        """Whether most of the assessable contacts are missed."""
        return 2 * self.missed > self.assessable > 0

    @property
    def two_standard_errors_ms(self) -> float:
        """Return two standard errors of the mean latency [ms]; 0 where they are not known."""
        return 0.0 if math.isnan(self.standard_error_ms) else 2.0 * self.standard_error_ms

    @property
    def standard_deviation_ms(self) -> float:
        """Return the standard deviation of the latency from log to log [ms]; NaN below two contacts."""
        return self.standard_error_ms * math.sqrt(self.assessable - self.missed)

    @property
    def uncertainty_ms(self) -> float:
        """Return half the range plus two standard errors: how much a test at the rig would tell [ms]."""
        return 0.5 * (self.range_ms[1] - self.range_ms[0]) + self.two_standard_errors_ms

    @property
    def telling(self) -> TellingReason | None:
        """Return why a test at the rig would tell much about this cell; None if it would not."""
        low, high = self.range_ms
        error = self.two_standard_errors_ms
        if 0 < self.missed < self.assessable:
            return TellingReason.MISSED_IN_PART
        least, most = with_model_error(low, high)
        if self.limit_ms is not None and least - error <= self.limit_ms <= most + error:
            return TellingReason.NEAR_LIMIT
        if not self.uncertainty_ms > 0.0:
            return None
        return TellingReason.ASSUMPTIONS if high - low > 2.0 * error else TellingReason.SCATTER


class TellingReason(Enum):
    """Why a test at the rig would tell much about a cell; the first of these that applies, the most telling first."""

    MISSED_IN_PART = "some contacts missed, others detected"
    NEAR_LIMIT = "a limit lies within the range, the error of the model and two standard errors"
    ASSUMPTIONS = "the latency depends on what is not known of the machine"
    SCATTER = "the latency differs from log to log"


@dataclass(frozen=True)
class TellingCell:
    """A cell that a test at the rig would tell much about, and why."""

    detector: str
    key: CellKey
    cell: MapCell
    reason: TellingReason


@dataclass(frozen=True)
class SpeedClass:
    """Logs of about the same contact speed: the median that names the class, the lowest and the highest."""

    speed: float | None
    lowest: float
    highest: float


@dataclass(frozen=True)
class CoverageMap:
    """The cells of every detector. `unit` of the positions: m, rad or s; `speed_unit` of the speeds: m/s or rad/s.

    `speeds`: the classes of contact speed, from slow to fast, by which the cells are split if there are several.
    """

    positions: tuple[float, ...]
    stiffnesses: tuple[float, ...]
    unit: str
    cells: Mapping[str, Mapping[CellKey, MapCell]]
    speeds: tuple[SpeedClass, ...] = (SpeedClass(None, math.nan, math.nan),)
    speed_unit: str = "m/s"

    def most_telling(self, count: int = 5) -> list[TellingCell]:
        """Return the cells that a test at the rig would tell most about: missed in part, near a limit, uncertain."""
        order = list(TellingReason)
        known = [
            TellingCell(name, key, cell, cell.telling)
            for name, cells in self.cells.items()
            for key, cell in cells.items()
            if cell.telling is not None
        ]
        # Uncertain is uncertain, whatever the source.
        urgency = {reason: min(order.index(reason), order.index(TellingReason.ASSUMPTIONS)) for reason in order}
        known.sort(key=lambda item: (urgency[item.reason], -np.nan_to_num(item.cell.uncertainty_ms)))
        return known[:count]

    def missed(self) -> list[tuple[str, CellKey, MapCell]]:
        """Return the cells with missed contacts, those with the largest missed share first."""
        known = [(name, key, cell) for name, cells in self.cells.items() for key, cell in cells.items() if cell.missed]
        known.sort(key=lambda item: -item[2].missed / item[2].assessable)
        return known


@dataclass(frozen=True)
class MappedContact:
    """An injected contact's cell, what is assumed about the machine, until when [s] it is reliable, and its speed."""

    key: CellKey
    assumption: str
    reliable_until: float
    speed: float = math.nan


def speed_classes(speeds: Mapping[str, Sequence[float]]) -> dict[str, float | None]:
    """Return the class of contact speed of each log, named by the median speed of its logs; None if all are alike.

    Speeds of both directions count as their magnitude. A class ends where the next faster log is faster by more than
    20 %; logs whose speeds grow in smaller steps are one class.

    Parameters
    ----------
    speeds : mapping
        Speeds of the contacts of each log [m/s or rad/s].

    Returns
    -------
    dict
        The speed of each log's class.

    Examples
    --------
    >>> speed_classes({"a": [0.2, 0.2], "b": [0.1], "c": [-0.21]})
    {'b': 0.1, 'a': 0.205, 'c': 0.205}
    >>> speed_classes({"a": [0.2], "b": [0.21]})
    {'a': None, 'b': None}
    """
    typical = {log: float(np.median(np.abs(values))) for log, values in speeds.items()}
    classes: list[list[str]] = []
    for log in sorted(typical, key=typical.__getitem__):
        # Neighbouring speeds that differ by more than 20 % belong to different classes.
        if not classes or typical[log] > 1.2 * typical[classes[-1][-1]]:
            classes.append([])
        classes[-1].append(log)
    if len(classes) < 2:
        return dict.fromkeys(typical)
    return {
        log: float(f"{np.median([typical[item] for item in members]):.3g}") for members in classes for log in members
    }


def coverage_map(
    rows: Sequence[ContactResult],
    contacts: Mapping[str, MappedContact],
    detectors: Sequence[str],
    units: tuple[str, str],
    limits: Sequence[LimitRule] = (),
) -> CoverageMap:
    """Return latency, force and misses of injected contacts over position and stiffness, per detector.

    Parameters
    ----------
    rows : sequence of ContactResult
        The scored contacts; those of other recordings are left out.
    contacts : mapping
        The cell of each injected recording by its name.
    detectors : sequence of str
        The detectors to map, in this order.
    units : (str, str)
        Units of the positions (m, rad or s) and of the speeds.
    limits : sequence of LimitRule
        The limits of the benchmark file; those of latencies in the groups of injected contacts are compared.

    Returns
    -------
    CoverageMap
        A detector without any row is left out.

    Examples
    --------
    >>> row = ContactResult("1.csv", "injected", "gm", None, 1.0, 0.0, 1.02, 20.0, "detected", 150.0, 400.0)
    >>> cell = MappedContact(CellKey(0.9, 5e5), "known", reliable_until=1.5)
    >>> found = coverage_map([row], {"1.csv": cell}, ["gm"], ("m", "m/s"))
    >>> found.cells["gm"][cell.key].latency_ms
    20.0
    """
    grouped: dict[str, dict[CellKey, list[ContactResult]]] = {name: {} for name in detectors}
    for row in rows:
        if row.recording in contacts and row.detector in grouped:
            grouped[row.detector].setdefault(contacts[row.recording].key, []).append(row)
    cells = {
        name: {key: _cell(items, contacts, limits) for key, items in by_key.items()}
        for name, by_key in grouped.items()
        if by_key
    }
    keys = {item.key for item in contacts.values()}
    return CoverageMap(
        tuple(sorted({key.position for key in keys})),
        tuple(sorted({key.stiffness for key in keys})),
        units[0],
        cells,
        _classes(contacts),
        units[1],
    )


def _classes(contacts: Mapping[str, MappedContact]) -> tuple[SpeedClass, ...]:
    speeds: dict[float | None, list[float]] = {}
    for item in contacts.values():
        speeds.setdefault(item.key.speed, []).append(abs(item.speed))
    classes = [SpeedClass(name, min(values), max(values)) for name, values in speeds.items()]
    return tuple(sorted(classes, key=lambda item: item.speed or 0.0))


def _cell(rows: Sequence[ContactResult], contacts: Mapping[str, MappedContact], limits: Sequence[LimitRule]) -> MapCell:
    recordings = sorted((_contact(row, contacts[row.recording]) for row in rows), key=_badness)
    detected = [item for item in recordings if item.outcome == _DETECTED]
    latencies: dict[str, list[float]] = {}
    for item in detected:
        latencies.setdefault(item.assumption, []).append(item.latency_ms)
    forces = [item.force_n for item in detected if not math.isnan(item.force_n)]
    every = [value for values in latencies.values() for value in values]
    means = [float(np.mean(values)) for values in latencies.values()]
    error = math.nan
    if len(every) > len(means):
        spread = sum(float(np.sum((np.array(values) - np.mean(values)) ** 2)) for values in latencies.values())
        error = math.sqrt(spread / (len(every) - len(means)) / len(every))
    missed = sum(item.is_missed for item in recordings)
    return MapCell(
        contacts=len(rows),
        missed=missed,
        not_assessable=len(rows) - missed - len(detected),
        latency_ms=float(np.mean(every)) if every else math.nan,
        standard_error_ms=error,
        range_ms=(min(means), max(means)) if means else (math.nan, math.nan),
        force_n=float(np.median(forces)) if forces else math.nan,
        unreliable=sum(not item.reliable for item in detected),
        limit_ms=min((rule.largest for rule in limits if _applies(rule, rows)), default=None),
        recordings=tuple(recordings),
    )


def _contact(row: ContactResult, case: MappedContact) -> CellContact:
    # A detected contact without a latency cannot be compared with the others.
    outcome = "not_assessable" if row.outcome == _DETECTED and row.latency_ms is None else row.outcome
    return CellContact(
        row.recording,
        outcome,
        math.nan if row.latency_ms is None else row.latency_ms,
        math.nan if row.force_at_alarm_n is None else row.force_at_alarm_n,
        case.assumption,
        abs(case.speed),
        row.alarm_s is None or row.alarm_s <= case.reliable_until,
    )


def _badness(contact: CellContact) -> tuple[int, float, str]:
    order = {_MISSED: 0, _DETECTED: 1}.get(contact.outcome, 2)
    return order, -contact.latency_ms if order == 1 else 0.0, contact.recording


def _applies(rule: LimitRule, rows: Sequence[ContactResult]) -> bool:
    """Return whether a limit is an upper bound of the latencies of these contacts of one detector."""
    if (
        rule.figure not in _OF_LATENCY
        or not math.isfinite(rule.largest)
        or rule.detector not in (ALL, rows[0].detector)
    ):
        return False
    return rule.group == ALL or any(row.group == rule.group for row in rows)
