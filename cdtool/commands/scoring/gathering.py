"""The results of a benchmark from the outcomes of its logs."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import Any

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import ConfigurationError, RecordingError
from cdtool.base.findings import Finding
from cdtool.commands.judging.impact_free import unchecked
from cdtool.commands.scoring.benchmark_file import HOLDOUT, BenchmarkFile
from cdtool.commands.scoring.counting import Exposure, SweepRows
from cdtool.commands.scoring.force_rows import point_rows
from cdtool.commands.scoring.log_outcome import LogOutcome
from cdtool.results.results import (
    ContactResult,
    FalseAlarmResult,
    ForceResult,
    RecordingFinding,
    RecordingResult,
    Results,
    Skipped,
)
from cdtool.truth.force.verdict import ForceVerdict


def results_before(
    setup: BenchmarkFile,
    provenance: Mapping[str, Any],
    detectors: Iterable[str],
    skipped: Iterable[Skipped] = (),
    findings: Iterable[RecordingFinding] = (),
) -> Results:
    """Return what is known of the results before a log is scored: no row of a log."""
    return Results(
        provenance=provenance,
        detectors=tuple(detectors),
        groups=setup.groups,
        conditions=setup.conditions,
        contacts=(),
        false_alarms=(),
        exposure=(),
        skipped=tuple(skipped),
        findings=(*setup.rules_of("").findings, *findings),
    )


def results_of(
    setup: BenchmarkFile,
    before: Results,
    outcomes: Iterable[tuple[str, LogOutcome]],
    factors: Mapping[str, FloatArray],
    learned: Mapping[str, str],
) -> Results:
    """Return the results of the `outcomes` of logs, each with its group, in the order of the benchmark file.

    `before` is what was known before the first of them, `factors` are the safety factors of the sweep by detector, and
    `learned` maps the hashes of the logs learned from to their names. Raises ConfigurationError if the same log, under
    any name, was learned from or given twice, RecordingError if no log could be scored.
    """
    recordings, contents = list[RecordingResult](), dict[str, str]()
    contacts, false_alarms = list[ContactResult](), list[FalseAlarmResult]()
    forces, tests = list[ForceResult](), defaultdict[tuple[str, str], list[ForceVerdict]](list)
    skipped, findings = [*before.skipped], [*before.findings]
    assumed_free = list[tuple[str, Finding]]()
    exposure, sweep = defaultdict[tuple[str, str], Exposure](Exposure), SweepRows(factors, HOLDOUT)
    # The unit of the value compared with the limits may differ from that of the signal.
    units, beside = dict[str, str](), dict[str, str]()
    for group, outcome in outcomes:
        skipped += outcome.skipped
        findings += outcome.findings
        assumed_free += outcome.rows.unchecked
        recording = outcome.recording
        if recording is None:
            continue
        recordings.append(recording)
        if recording.sha256:
            _check_content(setup, recording, contents.get(recording.sha256, ""), learned.get(recording.sha256, ""))
            contents[recording.sha256] = recording.recording
        for detector in outcome.detectors:
            found = [item for item in detector.operations if item is not None]
            for item in found:
                units.setdefault(detector.detector, item.unit)
                exposure[group, detector.detector].add(item)
                sweep.add(group, detector.detector, item)
            if found:
                exposure[group, detector.detector].recordings += 1
        if recording.point:
            tests[group, recording.point] += outcome.rows.verdicts
        contacts += outcome.contacts
        false_alarms += outcome.false_alarms
        forces += outcome.rows.forces
        beside |= {f"{recording.recording}, {name}": digest for name, digest in outcome.rows.beside}
    findings += unchecked(assumed_free)
    if not exposure and not setup.limits:
        raise _nothing_scored(setup, skipped)
    provenance = {**before.provenance, **({"load_cell_sha256": beside} if beside else {})}
    if "units" in provenance:
        provenance["units"] = provenance["units"] | units
    return replace(
        before,
        provenance=provenance,
        recordings=tuple(recordings),
        contacts=tuple(contacts),
        false_alarms=tuple(false_alarms),
        exposure=tuple(item.result(*key) for key, item in exposure.items()),
        forces=tuple(forces),
        points=tuple(point_rows(tests, {name: group.force for name, group in setup.impacts.items()})),
        sweep=tuple(sweep.rows(before.detectors, setup.groups)),
        skipped=tuple(skipped),
        # One about a file of which several groups have runs is the same in each of them.
        findings=tuple(dict.fromkeys(findings) if setup.has_runs else findings),
    )


def recordings_in(results: Results) -> set[str]:
    """Return the names of the recordings that were scored or left out by name."""
    return {row.recording for row in results.skipped} | {row.recording for row in results.recordings}


def _nothing_scored(setup: BenchmarkFile, skipped: Sequence[Skipped]) -> RecordingError:
    reason = f"; first reason: {skipped[0].recording}: {skipped[0].reason}" if skipped else ""
    hint = "" if skipped else "check with cdtool info"
    return RecordingError(f"{setup.path}: no recording could be scored{reason}", hint)


def _check_content(setup: BenchmarkFile, recording: RecordingResult, scored: str, learned: str) -> None:
    """Raise ConfigurationError if a recording has the content of one that was `scored` or `learned` from, by name."""
    name = recording.recording
    if scored == name:
        raise ConfigurationError(f"{setup.path}: {name} is scored twice", "name each run in one group only, and once")
    if scored:
        raise ConfigurationError(f"{setup.path}: {name} and {scored} have identical content", "score each log once")
    # A log in [learn] up to its contact and in a group is scored with what was learned from the others.
    if learned and not (setup.both and learned == name):
        raise ConfigurationError(
            f"{setup.path}: {name} has the same content as {learned}, which is used for learning",
            "use a recording either in [learn] or for scoring",
        )
