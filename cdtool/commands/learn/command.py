"""`cdtool learn-signature`."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cdtool.commands.console.console import (
    leave,
    plain,
    print_json,
    print_line,
    print_next,
    print_skipped,
    progress,
    table,
)
from cdtool.commands.console.options import (
    BudgetOption,
    ClusterOption,
    JobsOption,
    JsonOption,
    MachineOption,
    QuietOption,
    RequiredDetectorOption,
    logs_argument,
    one_detector,
    set_option,
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
    detectors: RequiredDetectorOption,
    settings: Annotated[list[str] | None, set_option("threshold.name=cusum", "LearningTable")] = None,
    false_alarm_budget: BudgetOption = None,
    jobs: JobsOption = 1,
    cluster: ClusterOption = None,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Learn the normal behaviour for a detector from impact-free runs: a signature or any other threshold.

    Example: cdtool learn-signature free/*.csv --machine machine.toml --detectors feekf -o gate.feekf.json
    """
    from cdtool.base.files.foreign import refuse_other_kind
    from cdtool.base.files.writing import resolved
    from cdtool.base.plain_text import counted
    from cdtool.commands.judging.settings_table import given_settings
    from cdtool.commands.learning.learning import learn_signature as learn
    from cdtool.execution.workers import Workers
    from cdtool.formats.signature_store import SIGNATURE, check_name, write_signature
    from cdtool.thresholds.signature import ENOUGH_RUNS

    check_name(output)
    resolved(output)
    refuse_other_kind(output, SIGNATURE)
    with progress("reading runs", quiet=quiet) as advance:
        learned = learn(
            logs,
            machine,
            one_detector(detectors),
            settings=given_settings(settings or ()),
            false_alarm_budget=false_alarm_budget,
            workers=Workers(jobs, cluster=cluster, progress=advance),
        )
    write_signature(output, learned.signature)
    for motion, runs in learned.runs:
        if runs < ENOUGH_RUNS and learned.signature.learns_limits:
            which = f" {motion.described}" if motion else ""
            text = f"{counted(runs, 'run')}{which}, fewer than {ENOUGH_RUNS}: its limits are less certain"
            print_line(f"warning: {text}", err=True)
    print_skipped(learned.skipped, learned.findings)
    _show(learned, machine, output, as_json=as_json, quiet=quiet)
    leave(learned.skipped, learned.findings)


def _show(learned: LearnedSignature, machine: Path, output: Path, *, as_json: bool, quiet: bool) -> None:
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
    print_line(f"{signature.described}; written to {plain(output)}")
    if quiet:
        return
    rows = [
        (signature.detector, motion.described if motion else "any", runs, signature.unit)
        for motion, runs in learned.runs
    ]
    table([("detector", "left"), ("class", "left"), ("runs", "right"), ("unit", "left")], rows)
    print_next("cdtool", "detect", "LOG", "--machine", machine, "--signature", output)
