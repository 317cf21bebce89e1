"""Where a machine notices a contact, how soon and at which force: latency over position and stiffness, per detector."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from cdtool.evaluation.results import ContactResult

_DETECTED, _MISSED = "detected", "missed"


@dataclass(frozen=True)
class CellKey:
    """A cell of the map: position along the travel in its unit, stiffness of the obstacle [N/m]."""

    position: float
    stiffness: float


@dataclass(frozen=True)
class Cell:
    """The contacts of one cell: their number, those missed and not assessable, and the outcome of the others.

    `latency_ms`: mean of the detected contacts, `standard_error_ms` of it from log to log (NaN below two), `range_ms`:
    least and greatest mean of the assumptions about what is not known, equal to the mean if all is known.
    `force_n`: median force at the alarm. `unreliable`: detected later than the injected contact is reliable.
    """

    contacts: int
    missed: int
    not_assessable: int
    latency_ms: float
    standard_error_ms: float
    range_ms: tuple[float, float]
    force_n: float
    unreliable: int

    @property
    def misses_most(self) -> bool:
        """Whether most of the assessable contacts are missed."""
        return 2 * self.missed > self.contacts - self.not_assessable > 0

    @property
    def uncertainty_ms(self) -> float:
        """Return half the range plus two standard errors: how much a test at the rig would tell [ms]."""
        error = 0.0 if math.isnan(self.standard_error_ms) else 2.0 * self.standard_error_ms
        return 0.5 * (self.range_ms[1] - self.range_ms[0]) + error


@dataclass(frozen=True)
class CoverageMap:
    """The cells of every detector. `unit` of the positions: m, rad or s. `profile`: how positions are named."""

    positions: tuple[float, ...]
    stiffnesses: tuple[float, ...]
    unit: str
    cells: Mapping[str, Mapping[CellKey, Cell]]

    def most_telling(self, count: int = 5) -> list[tuple[str, CellKey, Cell]]:
        """Return the cells that a test at the rig would tell most about: missed in part, or least certain."""
        known = [(name, key, cell) for name, cells in self.cells.items() for key, cell in cells.items()]
        split = [item for item in known if 0 < item[2].missed < item[2].contacts - item[2].not_assessable]
        rest = [item for item in known if item not in split and item[2].uncertainty_ms > 0.0]
        rest.sort(key=lambda item: -item[2].uncertainty_ms)
        return [*split, *rest][:count]


@dataclass(frozen=True)
class MappedContact:
    """An injected contact's cell, what is assumed about the machine, and until when [s] it is reliable."""

    key: CellKey
    assumption: str
    reliable_until: float


def coverage_map(
    rows: Sequence[ContactResult], contacts: Mapping[str, MappedContact], detectors: Sequence[str], unit: str
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
    unit : str
        Unit of the positions: m, rad or s.

    Returns
    -------
    CoverageMap
        A detector without any row is left out.

    Examples
    --------
    >>> row = ContactResult("1.csv", "injected", "gm", None, 1.0, 0.0, 1.02, 20.0, "detected", 150.0, 400.0)
    >>> cell = MappedContact(CellKey(0.9, 5e5), "known", reliable_until=1.5)
    >>> found = coverage_map([row], {"1.csv": cell}, ["gm"], "m")
    >>> found.cells["gm"][cell.key].latency_ms
    20.0
    """
    grouped: dict[str, dict[CellKey, list[ContactResult]]] = {name: {} for name in detectors}
    for row in rows:
        if row.recording in contacts and row.detector in grouped:
            grouped[row.detector].setdefault(contacts[row.recording].key, []).append(row)
    cells = {
        name: {key: _cell(items, contacts) for key, items in by_key.items()}
        for name, by_key in grouped.items()
        if by_key
    }
    keys = {item.key for item in contacts.values()}
    return CoverageMap(
        tuple(sorted({key.position for key in keys})), tuple(sorted({key.stiffness for key in keys})), unit, cells
    )


def _cell(rows: Sequence[ContactResult], contacts: Mapping[str, MappedContact]) -> Cell:
    latencies: dict[str, list[float]] = {}
    forces, unreliable = [], 0
    for row in rows:
        if row.outcome == _DETECTED and row.latency_ms is not None:
            case = contacts[row.recording]
            latencies.setdefault(case.assumption, []).append(row.latency_ms)
            unreliable += row.alarm_s is not None and row.alarm_s > case.reliable_until
            if row.force_at_alarm_n is not None:
                forces.append(row.force_at_alarm_n)
    every = [value for values in latencies.values() for value in values]
    means = [float(np.mean(values)) for values in latencies.values()]
    error = math.nan
    if len(every) > len(means):
        spread = sum(float(np.sum((np.array(values) - np.mean(values)) ** 2)) for values in latencies.values())
        error = math.sqrt(spread / (len(every) - len(means)) / len(every))
    return Cell(
        contacts=len(rows),
        missed=sum(row.outcome == _MISSED for row in rows),
        not_assessable=sum(row.outcome not in (_DETECTED, _MISSED) for row in rows),
        latency_ms=float(np.mean(every)) if every else math.nan,
        standard_error_ms=error,
        range_ms=(min(means), max(means)) if means else (math.nan, math.nan),
        force_n=float(np.median(forces)) if forces else math.nan,
        unreliable=unreliable,
    )
