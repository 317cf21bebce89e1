"""`cdtool detect`."""

from __future__ import annotations

import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cdtool.cli.console import leave, number, plain, print_error, print_json, print_skipped, progress, table
from cdtool.cli.options import (
    DebounceOption,
    DetectorOption,
    HysteresisOption,
    JointsOption,
    JsonOption,
    LatchOption,
    LimitOption,
    MachineOption,
    OnsetAboveOption,
    OnsetBackToOption,
    OperationsOption,
    RearmOption,
    SignatureOption,
    figure_name,
    limits_of,
    listed,
)
from cdtool.errors import CdtoolError, ExitStatus, SignatureError, UsageError
from cdtool.evaluation.results import Skipped

if TYPE_CHECKING:
    from cdtool.evaluation.truth.matching import Matching
    from cdtool.pipeline import Detection
    from cdtool.workflows.contact_force import ForceSummary
    from cdtool.workflows.detection import Detected

# Operations of which is told what could not be judged, and how many stretches of each.
_SHOWN, _STRETCHES = 6, 3


def detect(
    logs: Annotated[list[Path], typer.Argument(help="Recordings to analyse.", metavar="LOG...")],
    machine: MachineOption,
    signature: SignatureOption = None,
    limit: LimitOption = "",
    detector: DetectorOption = None,
    joints: JointsOption = "",
    contact_at: Annotated[
        str, typer.Option("--contact-at", help="Robots: estimate the force at LINK:X,Y,Z, m in the link's frame.")
    ] = "",
    operations: OperationsOption = "whole",
    debounce: DebounceOption = None,
    rearm: RearmOption = None,
    hysteresis: HysteresisOption = None,
    latch: LatchOption = None,
    onset_above: OnsetAboveOption = None,
    onset_back_to: OnsetBackToOption = None,
    plot: Annotated[
        Path | None, typer.Option("--plot", help="PNG, SVG or PDF to draw; a folder where several logs are given.")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Run one detector over logs and show its alarms.

    Example: cdtool detect stiff/01.csv --machine machine.toml --signature gate.feekf.json --plot out.png
    """
    from cdtool.evaluation.truth.onset import OnsetRule
    from cdtool.machine_file import read_machine_file
    from cdtool.workflows.contact_force import ContactPoint, summarise_force
    from cdtool.workflows.detection import detect as run
    from cdtool.workflows.runs import lost

    machine_file = read_machine_file(machine)
    limits = limits_of(limit)
    contact = ContactPoint.parse(contact_at) if contact_at else None
    plot_names = _plot_names(plot, logs)
    done: list[tuple[Path, Detected]] = []
    forces: dict[str, ForceSummary] = {}
    skipped: list[Skipped] = []
    with progress("detecting") as advance:
        for i, log in enumerate(logs, 1):
            try:
                found = run(
                    log,
                    machine_file,
                    signature=signature,
                    detector=detector,
                    limit=limits,
                    joints=listed(joints),
                    operations=operations,
                    activation={"debounce": debounce, "rearm": rearm, "hysteresis": hysteresis, "latch": latch},
                    onset=OnsetRule(above=onset_above, back_to=onset_back_to),
                )
                if contact:
                    made = [summarise_force(item, machine_file.machine, contact) for item in found.detections]
                    forces |= {item.operation: item for item in made}
                done.append((log, found))
                skipped += lost(found.recording)
                if plot_names:
                    from cdtool.report.plots.detection_plot import plot_detected

                    plot_detected(found, plot_names[log])
            except CdtoolError as fault:
                # What is wrong with the call or the signature is wrong for every log.
                if len(logs) == 1 or isinstance(fault, UsageError | SignatureError):
                    raise
                skipped.append(Skipped(str(log), str(fault)))
            if advance:
                advance(i, len(logs))
    if not done:
        for item in skipped:
            print_error(CdtoolError(item.reason))
        raise typer.Exit(ExitStatus.UNUSABLE)
    taught = "the signature was learned from it: no alarm here shows nothing"
    learned = [Skipped(str(log), taught) for log, found in done if found.learned]
    print_skipped(skipped, learned)
    if as_json:
        items = (
            (log, found, *pair) for log, found in done for pair in zip(found.detections, found.matchings, strict=True)
        )
        print_json([_as_json(*item, forces.get(item[2].operation.name)) for item in items])
    else:
        pairs = [pair for _, found in done for pair in zip(found.detections, found.matchings, strict=True)]
        _show(pairs, done[0][1].threshold)
        _show_not_judged([detection for _, found in done for detection in found.detections])
        _show_notes([detection for _, found in done for detection in found.detections])
        for force in list(forces.values())[:_SHOWN]:
            _show_force(force)
        for log, _ in done:
            if log in plot_names:
                typer.echo(f"plot written to {plain(plot_names[log])}")
    leave(skipped)


def _plot_names(plot: Path | None, logs: list[Path]) -> dict[Path, Path]:
    if plot is None:
        return {}
    if len(logs) == 1 and not plot.is_dir():
        return {logs[0]: figure_name(plot)}
    if plot.suffix:
        raise UsageError(f"--plot is one file for {len(logs)} logs", "give a folder")
    plot.mkdir(parents=True, exist_ok=True)
    return {log: plot / f"{i:03d}_{log.stem}.png" for i, log in enumerate(logs, 1)}


def _show(rows: list[tuple[Detection, Matching]], threshold: str) -> None:
    """A row for each alarm, for each contact without one, and for each operation without either."""
    cells = [cell for detection, matching in rows for cell in _rows_of(detection, matching)]
    unit = rows[0][0].statistic.unit
    columns = [("recording", "left"), ("verdict", "left"), ("time\ns", "right"), ("joint", "left")]
    columns += [(f"signal\n{unit}", "right"), ("limit", "right"), ("latency\nms", "right"), ("why", "left")]
    typer.echo(f"{rows[0][0].detector}: {plain(threshold)}")
    table(columns, cells)


def _rows_of(detection: Detection, matching: Matching) -> list[tuple[object, ...]]:
    name, joints = detection.operation.name, detection.statistic.joints
    latency = {item.alarm: item.latency for item in matching.matches if item.alarm}
    rows: list[tuple[object, ...]] = []
    for alarm in sorted({*detection.verdict.alarms, *latency}, key=lambda alarm: (alarm.time, alarm.joint)):
        late = number(1e3 * latency[alarm], 3) if alarm in latency else "-"
        figures = (number(alarm.statistic, 4), number(alarm.limit, 4), late)
        rows.append((name, "alarm", f"{alarm.time:.3f}", joints[alarm.joint], *figures, ""))
    for item in matching.matches:
        if not item.alarm:
            outcome = item.outcome.replace("_", " ")
            why = f"contact at {item.contact.start:.3f} s{': ' + item.reason if item.reason else ''}"
            rows.append((name, outcome, "-", "-", "-", "-", "-", why))
    if not rows:
        rows.append((name, detection.verdict.outcome, "-", "-", "-", "-", "-", detection.verdict.reason))
    return rows


def _show_force(force: ForceSummary) -> None:
    at_alarm = f"{force.at_alarm:.1f} N at the first alarm, " if math.isfinite(force.at_alarm) else ""
    largest = (
        f"largest {force.largest:.1f} N at {force.largest_at:.3f} s" if math.isfinite(force.largest) else "unknown"
    )
    typer.echo(f"{plain(force.operation)}: estimated force at {plain(str(force.contact))}: {at_alarm}{largest}")


def _show_notes(detections: list[Detection]) -> None:
    """What a detector wants to be known of its signal, of as many operations as for what could not be judged."""
    for detection in detections[:_SHOWN]:
        for note in detection.statistic.notes:
            typer.echo(f"{plain(detection.operation.name)}: {plain(note)}")


def _show_not_judged(detections: list[Detection]) -> None:
    """What share of an operation could not be judged, and when, where and why in its longest stretches."""
    shown = [detection for detection in detections if detection.statistic.shares()]
    for detection in shown[:_SHOWN]:
        longest = sorted(detection.not_judged(), key=lambda item: item.start - item.end)[:_STRETCHES]
        parts = []
        for item in sorted(longest, key=lambda item: item.start):
            where = f" ({item.way_start:.3g} to {item.way_end:.3g})" if math.isfinite(item.way_end) else ""
            parts.append(f"{item.start:.2f} to {item.end:.2f} s{where} {item.reason}")
        share = 1.0 - float(detection.statistic.valid.mean())
        typer.echo(f"not judged in {plain(detection.operation.name)}: {100.0 * share:.0f} %; {'; '.join(parts)}")
    if len(shown) > _SHOWN:
        typer.echo(f"not judged: and {len(shown) - _SHOWN} operations more (--json has all)")


def _as_json(
    log: Path, found: Detected, detection: Detection, matching: Matching, force: ForceSummary | None
) -> dict[str, Any]:
    joints = detection.statistic.joints
    return {
        "log": str(log),
        "operation": detection.operation.name,
        "detector": detection.detector,
        "unit": detection.statistic.unit,
        "threshold": found.threshold,
        "verdict": detection.verdict.outcome,
        "reason": detection.verdict.reason or None,
        "alarms": [
            {
                "time_s": alarm.time,
                "joint": joints[alarm.joint],
                "side": alarm.side,
                "statistic": alarm.statistic,
                "limit": alarm.limit,
            }
            for alarm in detection.verdict.alarms
        ],
        "contacts": [
            {
                "onset_s": item.contact.start,
                "onset_uncertainty_s": item.contact.uncertainty,
                "peak_force_n": item.contact.peak_force,
                "outcome": item.outcome,
                "alarm_s": item.alarm.time if item.alarm else None,
                "latency_ms": 1e3 * item.latency,
            }
            for item in matching.matches
        ],
        "not_judged": detection.statistic.shares(),
        "stretches_not_judged": [asdict(item) for item in detection.not_judged()],
        "estimated_force": _force_as_json(force) if force else None,
        "notes": list(detection.statistic.notes),
        "findings": [str(item) for item in found.recording.findings],
    }


def _force_as_json(force: ForceSummary) -> dict[str, Any]:
    figures = {"at_alarm_n": force.at_alarm, "largest_n": force.largest, "largest_at_s": force.largest_at}
    known = {name: value if math.isfinite(value) else None for name, value in figures.items()}
    return {"link": force.contact.link, "point_m": list(force.contact.point), **known}
