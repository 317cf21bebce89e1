"""Force over time of the contacts whose curves were stored, with their verdicts: the input of a figure of forces."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.recordings.recording import Contact
from cdtool.results.results import ForceResult, Results
from cdtool.results.traces.trace import Trace
from cdtool.truth.force.limits import ForceProfile, ForceStep
from cdtool.truth.force.verdict import ForceVerdict, Outcome, StepVerdict
from cdtool.truth.rest_level import rest_before

_OUTCOMES: tuple[Outcome, ...] = ("pass", "fail", "not_assessable")


@dataclass(frozen=True)
class TracedForce:
    """One contact: load-cell force (n,) [N] at times (n,) [s after the onset], decimated, and its verdict.

    The force is the cell's reading minus that at rest, positive if it presses; unlike the verdict it is not corrected
    for a mass before the cell. `alarms`: seconds from the onset to each detector's alarm. `trace`: the number of its
    trace.
    """

    recording: str
    group: str
    contact: int
    time: FloatArray
    force: FloatArray
    verdict: ForceVerdict
    alarms: Mapping[str, float]
    trace: int = 0

    @property
    def name(self) -> str:
        """Return the name of the recording, with the number of any contact but the first."""
        return self.recording if self.contact == 1 else f"{self.recording}, contact {self.contact}"


def force_profiles(results: Results) -> dict[str, ForceProfile]:
    """Return the profiles with which the results were compared.

    Parameters
    ----------
    results : Results
        The results of a benchmark.

    Returns
    -------
    dict of str to ForceProfile
        The profiles by name.

    Examples
    --------
    `cdtool.benchmark` returns the results.
    """
    found = {}
    for values in results.provenance.get("force_profiles", {}).values():
        steps = tuple(ForceStep(**step) for step in values["steps"])
        found[values["name"]] = ForceProfile(**{**values, "steps": steps})
    return found


def traced_forces(results: Results, traces: Sequence[Trace]) -> tuple[TracedForce, ...]:
    """Return every contact with a force verdict whose load-cell curve was stored.

    Parameters
    ----------
    results : Results
        The results of a benchmark.
    traces : sequence of Trace
        Its traces.

    Returns
    -------
    tuple of TracedForce
        In the order of the traces.

    Examples
    --------
    `cdtool.benchmark` returns results and traces.
    """
    verdicts = {(row.group, row.recording, row.contact): row for row in results.forces}
    onsets: dict[tuple[str, str], dict[int, float]] = {}
    alarms: dict[tuple[str, str, int], dict[str, float]] = {}
    for seen in results.contacts:
        key = (seen.group, seen.recording)
        onsets.setdefault(key, {})[seen.contact] = seen.onset_s
        if seen.latency_ms is not None:
            alarms.setdefault((*key, seen.contact), {})[seen.detector] = 1e-3 * seen.latency_ms
    found = []
    for place, trace in enumerate(traces):
        for number, contact, until in _contacts(trace, onsets.get((trace.group, trace.log), {})):
            of = (trace.group, trace.log, number)
            row, curve = verdicts.get(of), _curve(trace, contact, until)
            if row is not None and curve is not None:
                late = alarms.get(of, {})
                found.append(TracedForce(trace.log, trace.group, number, *curve, _verdict(row, *curve), late, place))
    return tuple(found)


def _contacts(trace: Trace, onsets: Mapping[int, float]) -> Iterator[tuple[int, Contact, float]]:
    """Yield the trace's contacts with their number and their end [s]; one ends where the next begins."""
    ends = [*(contact.start for contact in trace.contacts[1:]), math.inf]
    for contact, until in zip(trace.contacts, ends, strict=False):
        for number, onset in onsets.items():
            # The same number, which a file may have rounded.
            if abs(onset - contact.start) <= 1e-6:
                yield number, contact, until


def _curve(trace: Trace, contact: Contact, until: float) -> tuple[FloatArray, FloatArray] | None:
    present = np.isfinite(trace.force)
    time, reading = trace.force_time[present], trace.force[present]
    part = (time >= contact.start) & (time < until)
    if not part.any():
        return None
    rest = contact.rest if math.isfinite(contact.rest) else rest_before(time, reading, contact.start)
    force = (reading - rest)[part]
    if force[np.argmax(np.abs(force))] < 0.0:
        force = -force
    return time[part] - contact.start, force


def _verdict(row: ForceResult, time: FloatArray, force: FloatArray) -> ForceVerdict:
    """Return the row's verdict; the times of its peaks are read from the curve."""
    ends = [*(step.from_s for step in row.steps[1:]), math.inf]
    steps = []
    for step, until in zip(row.steps, ends, strict=True):
        inside = np.flatnonzero((time >= step.from_s) & (time < until))
        known = step.peak_n is not None and len(inside) > 0
        steps.append(
            StepVerdict(
                step=ForceStep(step.from_s, step.at_most_n, step.name),
                outcome=next((outcome for outcome in _OUTCOMES if outcome == step.verdict), "not_assessable"),
                peak=step.peak_n if step.peak_n is not None and known else math.nan,
                peak_at=float(time[inside[np.argmax(force[inside])]]) if known else math.nan,
                time_budget=math.inf if step.time_budget_ms is None else 1e-3 * step.time_budget_ms,
                reason=step.reason or "",
            )
        )
    return ForceVerdict(row.profile, tuple(steps), float(time[-1]))
