"""`cdtool identify`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any

import typer

from cdtool.cli.console import leave, plain, print_json, print_skipped, progress
from cdtool.cli.options import ForceOption, JobsOption, JsonOption
from cdtool.cli.place import Place, location
from cdtool.plain_text import counted, digits

if TYPE_CHECKING:
    from cdtool.identification.estimate import NotIdentifiable
    from cdtool.workflows.identification.identifying import IdentifiedMachine, JointIdentification


def identify(
    logs: Annotated[
        list[str], typer.Argument(help="Impact-free logs; patterns such as free/*.csv are allowed.", metavar="LOGS...")
    ],
    machine: Annotated[Place, typer.Option("--machine", "-m", parser=location, help="Machine file.")],
    output: Annotated[
        Place | None,
        typer.Option(
            "--output", "-o", parser=location, help="Machine file to write: the same file or a new one. Default: none."
        ),
    ] = None,
    force: ForceOption = False,
    jobs: JobsOption = 1,
    as_json: JsonOption = False,
) -> None:
    """Identify mass, drive, friction and controller of an axis from impact-free logs, with honest standard errors.

    Every change of the machine file is shown; old values remain in its comments.

    Example: cdtool identify 'sample_logs/gate/free/*.csv' -m sample_logs/gate/machine.toml -o machine.toml
    """
    from cdtool.workflows.execution.workers import Workers
    from cdtool.workflows.identification.identifying import identify as run

    with progress("identifying") as advance:
        done = run(logs, machine, output, force=force, workers=Workers(jobs), progress=advance)
    print_skipped(done.skipped, done.findings)
    if as_json:
        print_json(done.summary)
    else:
        _show(done)
    leave(done.skipped)


def _show(done: IdentifiedMachine) -> None:
    runs = counted(len(done.runs), "impact-free run")
    typer.echo(f"{plain(done.machine)}: identified from {runs}")
    _show_changes(done)
    for joint in done.joints:
        if len(done.joints) > 1:
            typer.echo(f"joint {plain(joint.joint)}")
        _show_quality(joint)
        for item in joint.not_identifiable:
            typer.echo(f"not identifiable: {item.section}.{item.key}{_needed(item)}")
        for method, reason in joint.refused.items():
            typer.echo(f"not used: {method.replace('_', '-')}: {plain(reason)}")
    if done.written:
        typer.echo(f"written: {plain(done.written)}")
    else:
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
