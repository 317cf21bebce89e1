"""`cdtool learn-signature`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cdtool.cli.console import leave, plain, print_json, print_skipped, progress, table
from cdtool.cli.options import (
    DebounceOption,
    JobsOption,
    JointsOption,
    JsonOption,
    MachineOption,
    OperationsOption,
    listed,
)
from cdtool.errors import ExitStatus, UsageError

if TYPE_CHECKING:
    from cdtool.workflows.learning import Learned


def learn_signature(
    logs: Annotated[list[Path], typer.Argument(help="Impact-free recordings, 10 or more a class.", metavar="LOG...")],
    machine: MachineOption,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Signature file to write (JSON).")] = None,
    detector: Annotated[
        str | None,
        typer.Option("--detector", "-d", help="Detector: feekf, gm, igm, pi, pt; see cdtool list detectors."),
    ] = None,
    update: Annotated[
        Path | None, typer.Option("--update", help="Add the runs to this signature file instead of learning anew.")
    ] = None,
    forget: Annotated[
        float | None,
        typer.Option("--forget", help="With --update: forget old runs, effective number of runs, 20 to 50."),
    ] = None,
    operations: OperationsOption = "whole",
    rule: Annotated[
        str, typer.Option("--rule", help="pooled, or thesis (mean + 1 std: alarms in almost every run).")
    ] = ("pooled"),
    safety_factor: Annotated[
        float | None,
        typer.Option("--safety-factor", "-k", help="Standard deviations from mean to limit. Default: 5.5."),
    ] = None,
    sides: Annotated[
        str | None,
        typer.Option(
            "--sides", help="one (that opposes the motion) or two. Default: one for an axis, two for a robot."
        ),
    ] = None,
    joints: JointsOption = "",
    align: Annotated[
        str, typer.Option("--align", help="time_then_position (time while accelerating), time, or position.")
    ] = "time_then_position",
    debounce: DebounceOption = None,
    force: Annotated[
        bool, typer.Option("--force", help="Learn from fewer than 10 runs; the limits are less sure.")
    ] = False,
    jobs: JobsOption = 1,
    as_json: JsonOption = False,
) -> None:
    """Learn the normal band of a detector from impact-free runs, or add runs to it (--update).

    Example: cdtool learn-signature free/*.csv --machine machine.toml --detector feekf -o gate.feekf.json
    """
    if update is not None:
        if detector is not None or output is not None:
            raise UsageError("--update takes detector and file from the signature", "leave --detector and -o out")
        _update(update, logs, machine, operations, forget, jobs, as_json)
        return
    if detector is None or output is None:
        raise UsageError("--detector and -o are needed", "or --update FILE to add runs to a signature")
    if forget is not None:
        raise UsageError("--forget belongs to --update", "leave it out")
    from cdtool.signature_store import write_signature
    from cdtool.thresholds.signature import ENOUGH_RUNS, Signature
    from cdtool.workflows.learning import learn_signature as learn

    settings = Signature(safety_factor=safety_factor, sides=sides, alignment=align, rule=rule, force=force)
    with progress("reading runs") as advance:
        learned = learn(
            logs,
            machine,
            detector,
            rule=settings,
            joints=listed(joints),
            operations=operations,
            debounce=debounce,
            jobs=jobs,
            progress=advance,
        )
    write_signature(output, learned.signature)
    for motion, runs in learned.runs:
        if runs < ENOUGH_RUNS:
            text = f"{runs} runs {motion.described}, fewer than {ENOUGH_RUNS}: its limits are less sure"
            typer.echo(f"warning: {text}", err=True)
    print_skipped(learned.skipped, learned.findings)
    _show(learned, output, as_json)
    leave(learned.skipped)


def _show(learned: Learned, output: Path, as_json: bool) -> None:
    signature = learned.signature
    if as_json:
        print_json(
            {
                "file": str(output),
                "detector": signature.detector,
                "unit": signature.unit,
                "classes": [
                    {"direction": motion.direction, "nominal_speed": motion.nominal_speed, "runs": runs}
                    for motion, runs in learned.runs
                ],
                "skipped": [{"recording": item.recording, "reason": item.reason} for item in learned.skipped],
            }
        )
        return
    rows = [(signature.detector, motion.described, runs, signature.unit) for motion, runs in learned.runs]
    table([("detector", "left"), ("class", "left"), ("runs", "right"), ("unit", "left")], rows)
    typer.echo(f"signature written to {plain(output)}")


def _update(
    file: Path, logs: list[Path], machine: Path, operations: str, forget: float | None, jobs: int, as_json: bool
) -> None:
    from cdtool.workflows.learning import update_with_runs

    with progress("reading runs") as advance:
        signature, added, refused = update_with_runs(
            file, logs, machine, operations=operations, forget=forget, jobs=jobs, progress=advance
        )
    print_skipped(refused)
    if as_json:
        reasons = [{"recording": item.recording, "reason": item.reason} for item in refused]
        print_json({"file": str(file), "added": list(added), "refused": reasons})
    else:
        many = "run" if len(added) == 1 else "runs"
        counts = f"{len(refused)} refused; {len(signature.runs)} in all"
        typer.echo(f"{len(added)} {many} added to {plain(file)}, {counts}")
    if not added:
        raise typer.Exit(ExitStatus.UNUSABLE)
    leave(refused)
