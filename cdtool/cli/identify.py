"""`cdtool identify`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cdtool.cli.console import leave, number, plain, print_json, print_skipped, progress, table
from cdtool.cli.options import ForceOption, JobsOption, JsonOption
from cdtool.cli.place import Place, location
from cdtool.errors import UsageError, nearest
from cdtool.plain_text import counted, digits

if TYPE_CHECKING:
    from cdtool.identification.estimate import NotIdentifiable
    from cdtool.workflows.execution.workers import Workers
    from cdtool.workflows.identification.fleet_identification import FleetIdentification
    from cdtool.workflows.identification.identifying import IdentifiedMachine, JointIdentification

_DIVISIONS = ("machine", "day")


def identify(
    logs: Annotated[
        list[str], typer.Argument(help="Impact-free logs; patterns such as free/*.csv are allowed.", metavar="LOGS...")
    ],
    machine: Annotated[Place, typer.Option("--machine", "-m", parser=location, help="Machine file.")],
    output: Annotated[
        list[Place] | None,
        typer.Option(
            "--output",
            "-o",
            parser=location,
            help="Output, repeatable: .toml (machine file: the same or a new one), .html, .json. Default: none.",
        ),
    ] = None,
    by: Annotated[
        str | None,
        typer.Option("--by", help="machine or day: one identification for each, and what changes; -o .html, .json."),
    ] = None,
    loaded_logs: Annotated[
        list[str] | None,
        typer.Option("--loaded-logs", help="Of a robot: logs with a known payload, for torque constants; repeatable."),
    ] = None,
    payload: Annotated[
        float | None, typer.Option("--payload", help="With --loaded-logs: mass of the payload at the last link [kg].")
    ] = None,
    force: ForceOption = False,
    jobs: JobsOption = 1,
    as_json: JsonOption = False,
) -> None:
    """Identify mass, drive, friction and controller of an axis from impact-free logs, with honest standard errors.

    Every change of the machine file is shown; old values remain in its comments.

    Example: cdtool identify 'sample_logs/gate/free/*.csv' -m sample_logs/gate/machine.toml -o machine.toml
    """
    from cdtool.report.identification_files import check_identification_files
    from cdtool.workflows.execution.workers import Workers

    targets = output or []
    if by is not None and by not in _DIVISIONS:
        raise UsageError(f"--by is '{by}'", nearest(by, _DIVISIONS))
    check_identification_files(targets, machine, force=force, of_fleet=by is not None)
    if bool(loaded_logs) != (payload is not None):
        raise UsageError("--loaded-logs and --payload belong together", "give both, or neither")
    if by is not None and loaded_logs:
        raise UsageError("--by with --loaded-logs", "identify torque constants of one machine at a time")
    if by is not None:
        _identify_fleet(logs, machine, by, targets, Workers(jobs), as_json=as_json)
    else:
        loaded = (tuple(loaded_logs), payload) if loaded_logs and payload is not None else None
        _identify_machine(logs, machine, targets, Workers(jobs), loaded, as_json=as_json)


def _identify_machine(
    logs: Sequence[str],
    machine: Path,
    targets: Sequence[Path],
    workers: Workers,
    loaded: tuple[tuple[str, ...], float] | None,
    *,
    as_json: bool,
) -> None:
    from cdtool.report.identification_files import MACHINE, PAGE, write_identification
    from cdtool.workflows.identification.identification_outputs import evidence_of, identification_summary
    from cdtool.workflows.identification.identifying import identify as run
    from cdtool.workflows.identification.identifying_robot import LoadedRuns
    from cdtool.workflows.runs import find_logs

    runs = None if loaded is None else LoadedRuns(*loaded)
    with progress("identifying") as advance:
        done = run(logs, machine, workers=workers, progress=advance, other_logs=runs)
    needs_samples = any(target.suffix.lower() == PAGE for target in targets)
    evidence = evidence_of(done, logs, machine, workers) if needs_samples else ()
    written = write_identification(done, evidence, targets, find_logs(logs, Path(), "LOGS"))
    done = replace(done, written=", ".join(str(path) for path in written if path.suffix.lower() == MACHINE))
    print_skipped(done.skipped, done.findings)
    if as_json:
        print_json(identification_summary(done, evidence, written))
    else:
        _show(done, written, targets)
    leave(done.skipped)


def _identify_fleet(
    logs: Sequence[str], machine: Path, by: str, targets: Sequence[Path], workers: Workers, *, as_json: bool
) -> None:
    from cdtool.report.identification_files import write_fleet
    from cdtool.workflows.identification.fleet_identification import Division, identify_fleet
    from cdtool.workflows.runs import find_logs

    with progress("identifying") as advance:
        fleet = identify_fleet(logs, machine, Division(by), workers=workers, progress=advance)
    write_fleet(fleet, targets, [machine, *find_logs(logs, Path(), "LOGS")])
    print_skipped(fleet.skipped, fleet.findings)
    if as_json:
        print_json(fleet.summary)
    else:
        _show_fleet(fleet, targets)
    leave(fleet.skipped)


def _show_fleet(fleet: FleetIdentification, targets: Sequence[Path]) -> None:
    rows = [
        (
            item.machine,
            series.name,
            number(series.values[0], 4),
            number(series.values[-1], 4),
            series.unit,
            number(series.drift.standard_errors),
        )
        for item in fleet.machines
        for series in item.changed
    ]
    if rows:
        columns = [("machine", "left"), ("parameter", "left"), ("first", "right"), ("last", "right"), ("unit", "left")]
        table([*columns, ("change in\nstandard errors", "right")], rows)
    changed = sum(bool(item.changed) for item in fleet.machines)
    assessable = sum(any(len(series.periods) > 1 for series in item.series) for item in fleet.machines)
    typer.echo(
        f"{counted(len(fleet.machines), 'machine')} identified, {assessable} assessable over time, {changed} changed "
        f"beyond 3 standard errors"
    )
    for target in targets:
        typer.echo(f"written: {plain(target)}")


def _show(done: IdentifiedMachine, written: Sequence[Path], targets: Sequence[Path]) -> None:
    from cdtool.report.identification_words import words_of_plan
    from cdtool.workflows.identification.identification_outputs import plan_of

    runs = counted(len(done.runs), "impact-free run")
    typer.echo(f"{plain(done.machine)}: identified from {runs}")
    _show_changes(done)
    for joint in done.joints:
        if len(done.joints) > 1:
            typer.echo(f"joint {plain(joint.joint)}")
        _show_quality(joint)
        for item in joint.not_identifiable:
            typer.echo(f"not identifiable: {item.section}.{item.key}{_needed(item)}")
        for plan in plan_of(joint):
            typer.echo(f"plan: {words_of_plan(plan, joint.units[2])}: for {', '.join(plan.keys)}")
        for method, reason in joint.refused.items():
            typer.echo(f"not used: {method.replace('_', '-')}: {plain(reason)}")
    for path in written:
        typer.echo(f"written: {plain(path)}")
    for target in targets:
        if target not in written:
            typer.echo(f"not written: {plain(target)}: nothing new predicts unseen runs better")
    if not targets:
        typer.echo("nothing is written: give -o machine.toml")


def _show_changes(done: IdentifiedMachine) -> None:
    rows = [("key", "old", "new", "standard error", "unit")]
    for change in done.changes:
        old = "-" if change.old[0] is None else _numbers([item or 0.0 for item in change.old])
        errors = _numbers([float(f"{item:.2g}") for item in change.standard_errors if item == item]) or "-"
        rows.append((f"{change.section}.{change.key}", old, _numbers(change.values), errors, change.unit))
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    for row in rows:
        typer.echo("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip())


def _numbers(values: Any) -> str:
    texts = [digits(float(f"{value:.6g}")) for value in values]
    return texts[0] if len(set(texts)) == 1 else ", ".join(texts)


def _show_quality(joint: JointIdentification) -> None:
    if joint.robot is not None:
        error = joint.robot.errors.get(joint.robot.form, math.nan)
        typer.echo(
            f"torque on unseen runs: {number(error)} of {number(joint.robot.torque)} N m or N RMS "
            f"({joint.robot.form.value})"
        )
    validation = joint.rigid.cross_validation if joint.rigid else None
    if validation is not None:
        best = validation.errors[validation.best]
        floor = f", between equal strokes {digits(float(f'{validation.floor:.3g}'))}" if validation.repeats else ""
        typer.echo(
            f"force on unseen runs: {digits(float(f'{best.all:.3g}'))} {joint.units[1]} RMS, while moving "
            f"{digits(float(f'{best.moving:.3g}'))}{floor} ({validation.best.value})"
        )
    if joint.two_mass is not None:
        force, error = joint.two_mass.nominal_friction
        typer.echo(
            f"friction at nominal speed: {digits(float(f'{force:.4g}'))} +- {digits(float(f'{error:.2g}'))} "
            f"{joint.units[1]}; condition number {joint.two_mass.condition_number:.3g}"
        )


def _needed(item: NotIdentifiable) -> str:
    needs = ", ".join(missing.value for missing in item.missing)
    return f": add {needs}" if needs else ""
