"""A small coverage map with everything that its page shows, made without running a detector."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cdtool.commands.inject.coverage.coverage import Coverage
from cdtool.commands.inject.coverage.coverage_map import CellKey, MappedContact, coverage_map
from cdtool.recordings.recording import Contact
from cdtool.results.limits import LimitRule
from cdtool.results.results import ContactResult, RecordingFinding, Skipped
from cdtool.results.traces.trace import ContactOutcome, Panel, StatisticCurve, Trace

ONSET = 2.0
SOFT, STIFF = 1e4, 1e5
# Latency [ms] of "quick" and of "slow", None: missed; by position, stiffness and log.
LATENCIES = {
    (0.5, STIFF): ((20.0, 22.0), (60.0, 64.0)),
    (0.5, SOFT): ((50.0, 54.0), (200.0, None)),
    (1.0, STIFF): ((21.0, 23.0), (61.0, 66.0)),
    (1.0, SOFT): ((52.0, 55.0), (None, None)),
}


def coverage_case(named: Callable[[str], str] = str, *, speeds: tuple[float, float] = (0.2, 0.2)) -> Coverage:
    """Two detectors, two positions, two stiffnesses and two logs; `slow` misses soft contacts.

    `named` changes names, `speeds` of the two logs [m/s].
    """
    detectors = (named("quick"), named("slow"))
    split = speeds[0] != speeds[1]
    contacts, rows, traces = {}, [], {}
    for (position, stiffness), latencies in LATENCIES.items():
        for log, speed in enumerate(speeds):
            name = named(f"{stiffness:g}_{position:g}_{log}.csv")
            contacts[name] = MappedContact(
                CellKey(position, stiffness, speed if split else None), named("rigid"), ONSET + 0.2, speed
            )
            late = [of_detector[log] for of_detector in latencies]
            rows += [_row(name, detector, value) for detector, value in zip(detectors, late, strict=True)]
            if log == 0 or None in late:
                traces[name] = _trace(name, detectors, late)
    rules = [LimitRule("slow.*.max_ms", detectors[1], "*", "max_ms", largest=64.0)]
    return Coverage(
        named("gate"),
        coverage_map(rows, contacts, detectors, ("m", "m/s"), rules),
        (Skipped(named("lost.csv"), named("no motion")),),
        (RecordingFinding(named("odd.csv"), named("a gap"), "warning"),),
        traces,
    )


def _row(name: str, detector: str, late: float | None) -> ContactResult:
    return ContactResult(
        recording=name,
        group="injected_x",
        detector=detector,
        joint="axis",
        onset_s=ONSET,
        onset_uncertainty_s=0.0,
        alarm_s=None if late is None else ONSET + 1e-3 * late,
        latency_ms=late,
        outcome="missed" if late is None else "detected",
        force_at_alarm_n=None if late is None else 10.0 * late,
        peak_force_n=1000.0,
    )


def _trace(name: str, detectors: tuple[str, ...], late: list[float | None]) -> Trace:
    time = np.arange(0.0, 3.0, 0.01)
    value = np.where(time > ONSET, time - ONSET, 0.0)
    band = np.full(len(time), 0.05)
    curve = StatisticCurve(time, value, -band, band, np.zeros(len(time), dtype=np.uint8))
    panels = []
    for detector, latency in zip(detectors, late, strict=True):
        alarm = () if latency is None else (ONSET + 1e-3 * latency,)
        seen = ContactOutcome("missed") if latency is None else ContactOutcome("detected", 1e-3 * latency, alarm[0])
        panels.append(Panel(detector, "N", "axis", curve, "alarm", "", (seen,), alarm, ()))
    return Trace(
        name, "injected_x", 0.0, 3.0, (Contact(ONSET, 3.0, 0.0),), 0, (1.9, 2.4), time, 1e3 * value, tuple(panels)
    )
