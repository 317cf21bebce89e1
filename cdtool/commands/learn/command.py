"""`cdtool learn-signature`."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cdtool.commands.console import completions
from cdtool.commands.console.console import leave, plain, print_json, print_skipped, progress, table
from cdtool.commands.console.logs_argument import logs_argument
from cdtool.commands.console.options import (
    ClusterOption,
    DebounceOption,
    FromOption,
    HysteresisOption,
    JobsOption,
    JointsOption,
    JsonOption,
    LatchOption,
    MachineOption,
    OnsetAboveOption,
    OperationsOption,
    QuietOption,
    RearmOption,
    RetriesOption,
    TimeoutOption,
    ToOption,
    listed,
    section_of,
)
from cdtool.commands.console.place import Place, location

if TYPE_CHECKING:
    from cdtool.commands.learning.learning import LearnedSignature


def learn_signature(
    logs: Annotated[
        list[Place],
        logs_argument("Impact-free recordings, 10 or more per class."),
    ],
    machine: MachineOption,
    output: Annotated[Place, typer.Option("--output", "-o", parser=location, help="Signature file to write (.json).")],
    detector: Annotated[
        str,
        typer.Option(
            "--detector",
            "-d",
            help="Detector: feekf, gm, igm, pi, pt; see cdtool list detectors.",
            autocompletion=completions.detectors,
        ),
    ],
    threshold: Annotated[
        str,
        typer.Option(
            "--threshold",
            "-t",
            help="What to learn: signature, cusum ...; see cdtool list thresholds.",
            autocompletion=completions.thresholds,
        ),
    ] = "signature",
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="A setting of the threshold, repeatable: --set drift=0.5."),
    ] = None,
    false_alarm_budget: Annotated[
        str | None,
        typer.Option("--false-alarm-budget", help="Set the safety factor for this rate, as 1/300op or 0.1/h."),
    ] = None,
    from_: FromOption = None,
    to: ToOption = None,
    guard: Annotated[
        float | None,
        typer.Option("--guard", help="Also learn from logs with contacts: up to this many seconds before the first."),
    ] = None,
    operations: OperationsOption = "whole",
    rule: Annotated[
        str,
        typer.Option(
            "--rule",
            help="Signature: pooled, or thesis (mean + 1 std: alarms in almost every run).",
            autocompletion=completions.rules,
        ),
    ] = "pooled",
    safety_factor: Annotated[
        float | None,
        typer.Option("--safety-factor", "-k", help="Standard deviations from mean to limit. Default: 5.5."),
    ] = None,
    sides: Annotated[
        str | None,
        typer.Option(
            "--sides",
            help="one (that opposes the motion) or two. Default: one for an axis, two for a robot.",
            autocompletion=completions.sides,
        ),
    ] = None,
    joints: JointsOption = "",
    align: Annotated[
        str,
        typer.Option(
            "--align",
            help="time_then_position (time while accelerating), time, or position.",
            autocompletion=completions.alignments,
        ),
    ] = "time_then_position",
    debounce: DebounceOption = None,
    rearm: RearmOption = None,
    hysteresis: HysteresisOption = None,
    latch: LatchOption = None,
    onset_above: OnsetAboveOption = None,
    force: Annotated[
        bool, typer.Option("--force", help="Learn from fewer than 10 runs; the limits are less certain.")
    ] = False,
    jobs: JobsOption = 1,
    cluster: ClusterOption = None,
    timeout: TimeoutOption = None,
    retries: RetriesOption = 1,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Learn the normal behaviour for a detector from impact-free runs: a signature or any other threshold.

    Example: cdtool learn-signature free/*.csv --machine machine.toml --detector feekf -o gate.feekf.json
    """
    from cdtool.base.files.foreign import refuse_other_kind
    from cdtool.base.files.writing import resolved
    from cdtool.base.plain_text import counted
    from cdtool.commands.learning.learning import learn_signature as learn
    from cdtool.commands.learning.threshold_settings import rule_of
    from cdtool.execution.workers import Workers
    from cdtool.formats.machine_file import read_machine_file
    from cdtool.formats.signature_store import SIGNATURE, check_name, write_signature
    from cdtool.thresholds.signature import ENOUGH_RUNS
    from cdtool.truth.onset import OnsetRule

    check_name(output)
    resolved(output)
    refuse_other_kind(output, SIGNATURE)
    machine_file = read_machine_file(machine)
    own: dict[str, Any] = {"rule": rule, "alignment": align, "force": force}
    own |= {"safety_factor": safety_factor} if safety_factor is not None else {}
    own |= {"sides": sides} if sides is not None else {}
    with progress("reading runs", quiet=quiet) as advance:
        learned = learn(
            logs,
            machine_file,
            detector,
            rule=rule_of(threshold, settings or (), own, machine_file.machine.default_sides),
            joints=listed(joints),
            section=section_of(from_, to),
            guard=guard,
            operations=operations,
            activation={"debounce": debounce, "rearm": rearm, "hysteresis": hysteresis, "latch": latch},
            false_alarm_budget=false_alarm_budget,
            onset=OnsetRule(above=onset_above),
            workers=Workers(jobs, timeout, retries, cluster),
            progress=advance,
        )
    write_signature(output, learned.signature)
    for motion, runs in learned.runs:
        if runs < ENOUGH_RUNS and learned.signature.learns_limits:
            which = f" {motion.described}" if motion else ""
            text = f"{counted(runs, 'run')}{which}, fewer than {ENOUGH_RUNS}: its limits are less certain"
            typer.echo(f"warning: {text}", err=True)
    print_skipped(learned.skipped, learned.findings)
    _show(learned, output, as_json=as_json, quiet=quiet)
    leave(learned.skipped, learned.findings)


def _show(learned: LearnedSignature, output: Path, *, as_json: bool, quiet: bool) -> None:
    signature = learned.signature
    if as_json:
        print_json(
            {
                "file": str(output),
                "detector": signature.detector,
                "unit": signature.unit,
                "threshold": signature.threshold,
                "safety_factor": signature.current[0].safety_factor,
                "safety_factor_set": str(signature.origin),
                "classes": [
                    {
                        "direction": motion.direction if motion else None,
                        "nominal_speed": motion.nominal_speed if motion else None,
                        "runs": runs,
                    }
                    for motion, runs in learned.runs
                ],
                "skipped": [asdict(item) for item in learned.skipped],
                "findings": [asdict(item) for item in learned.findings],
            }
        )
        return
    rows = [
        (signature.detector, motion.described if motion else "any", runs, signature.unit)
        for motion, runs in learned.runs
    ]
    if not quiet:
        table([("detector", "left"), ("class", "left"), ("runs", "right"), ("unit", "left")], rows)
    typer.echo(f"{signature.described}; written to {plain(output)}")
