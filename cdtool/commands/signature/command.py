"""`cdtool signature show|check|update`."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

import typer

from cdtool.base.exit_status import Fact, statuses_words
from cdtool.base.plain_text import counted
from cdtool.commands.console.console import leave, plain, print_json, print_line, print_skipped, progress
from cdtool.commands.console.options import (
    ClusterOption,
    JobsOption,
    JsonOption,
    MachineOption,
    QuietOption,
    logs_argument,
    set_option,
)
from cdtool.commands.console.place import Place, location
from cdtool.commands.signature.shown import checked_as_json, file_as_json, show_class, show_file

signature = typer.Typer(
    help="Show a signature, check it against runs, add runs to it.",
    no_args_is_help=True,
    rich_markup_mode=None,
)


@signature.callback()
def _signature() -> None:
    """Show a signature, check it against runs, add runs to it."""


FileArgument = Annotated[
    Place,
    typer.Argument(
        parser=location,
        help="Signature file from cdtool learn-signature.",
        metavar="SIGNATURE",
    ),
]
UpkeepOption = Annotated[list[str] | None, set_option("onset.above_n=20", "UpkeepTable")]


@signature.command("show", epilog=statuses_words("signature show"))
def show(file: FileArgument, as_json: JsonOption = False) -> None:
    """Show a signature file: machine, detector, threshold, classes of motion, runs, and how far the limits have moved.

    Example: cdtool signature show gate.feekf.json
    """
    from cdtool.commands.learning.normal_runs import notes_on
    from cdtool.formats.signature_store import read_signature

    stored = read_signature(file)
    print_skipped((), notes_on(stored))
    if as_json:
        print_json(file_as_json(stored))
    else:
        show_file(stored)


@signature.command("check", epilog=statuses_words("signature check"))
def check(
    file: FileArgument,
    logs: Annotated[
        list[Place],
        logs_argument("Impact-free recordings: the runs learned from and later ones, in order."),
    ],
    machine: MachineOption,
    target: Annotated[float, typer.Option("--target", help="False-alarm probability to demonstrate.")] = 1e-3,
    settings: UpkeepOption = None,
    jobs: JobsOption = 1,
    cluster: ClusterOption = None,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Check whether a signature was learned from enough runs and whether the machine has drifted since.

    Runs in the signature are checked against a signature of all the others (leave one out). Other runs are treated as a
    season, in the given order.

    Example: cdtool signature check gate.feekf.json free/*.csv april.mcap -m machine.toml
    """
    from cdtool.commands.judging.settings_table import given_settings
    from cdtool.commands.learning.normal_runs import notes_on
    from cdtool.commands.signature.upkeep import check_signature
    from cdtool.execution.workers import Workers

    with progress("reading runs", quiet=quiet) as advance:
        checked = check_signature(
            file,
            logs,
            machine,
            target=target,
            settings=given_settings(settings or ()),
            workers=Workers(jobs, cluster=cluster, progress=advance),
        )
    if as_json:
        print_json(checked_as_json(checked))
    else:
        for item in checked.classes:
            show_class(item, quiet=quiet)
    print_skipped(checked.skipped, [*checked.findings, *notes_on(checked.file)])
    nothing = all(item.coverage is None and item.drift is None for item in checked.classes)
    leave(checked.skipped, checked.findings, [Fact.NOTHING_USABLE] if nothing else ())


@signature.command("update", epilog=statuses_words("signature update"))
def update(
    file: FileArgument,
    logs: Annotated[list[Place], logs_argument("Impact-free recordings to add.")],
    machine: MachineOption,
    forget: Annotated[float | None, typer.Option("--forget", help="Runs to remember, 20 to 50; default: all.")] = None,
    cap: Annotated[float | None, typer.Option("--cap", help="Spreads that a run may deviate at most.")] = None,
    reserve: Annotated[float | None, typer.Option("--reserve", help="Spreads that a limit may move in all.")] = None,
    settings: UpkeepOption = None,
    jobs: JobsOption = 1,
    cluster: ClusterOption = None,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Add impact-free runs to a signature without learning a slowly growing fault.

    Example: cdtool signature update gate.feekf.json april/*.csv -m machine.toml --forget 30
    """
    from cdtool.commands.judging.settings_table import given_settings
    from cdtool.commands.learning.normal_runs import notes_on
    from cdtool.commands.signature.upkeep import update_signature
    from cdtool.execution.workers import Workers
    from cdtool.thresholds.guarded_update import CAP, RESERVE

    with progress("reading runs", quiet=quiet) as advance:
        done = update_signature(
            file,
            logs,
            machine,
            forget=forget,
            cap=CAP if cap is None else cap,
            reserve=RESERVE if reserve is None else reserve,
            settings=given_settings(settings or ()),
            workers=Workers(jobs, cluster=cluster, progress=advance),
        )
    print_skipped(done.refused, [*done.findings, *notes_on(done.file)])
    if as_json:
        refused, findings = [asdict(item) for item in done.refused], [asdict(item) for item in done.findings]
        print_json({"file": str(file), "added": list(done.added), "refused": refused, "findings": findings})
    else:
        counts = f"{len(done.refused)} refused; {len(done.file.runs)} in total"
        print_line(f"{counted(len(done.added), 'run')} added to {plain(file)}, {counts}")
    leave(done.refused, done.findings, () if done.added else [Fact.NOTHING_USABLE])
