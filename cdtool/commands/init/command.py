"""`cdtool init`."""

from __future__ import annotations

import shlex
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cdtool.base.errors import UsageError
from cdtool.commands.console.console import (
    leave,
    leave_with,
    plain,
    print_json,
    print_line,
    print_skipped,
    progress,
    with_findings,
)
from cdtool.commands.console.options import (
    JsonOption,
    logs_argument,
)
from cdtool.commands.console.place import Place, location

if TYPE_CHECKING:
    from cdtool.commands.init.drafting import Drafted, DraftedStudy


def init(
    logs: Annotated[list[Place], logs_argument("Recordings of one machine.")],
    output: Annotated[
        Place,
        typer.Option(
            "--output",
            "-o",
            parser=location,
            help="Machine file to write (.toml); or a folder for a machine file and a benchmark file.",
        ),
    ] = Path("machine.toml"),
    machine: Annotated[
        Place | None,
        typer.Option(
            "--machine", "-m", parser=location, help="With a folder: use this machine file, draft only the benchmark."
        ),
    ] = None,
    free: Annotated[
        list[str] | None,
        typer.Option("--free", help="Impact-free logs to learn from, or a pattern, as 'free/*.csv'; repeatable."),
    ] = None,
    urdf: Annotated[
        Place | None,
        typer.Option(
            "--urdf",
            parser=location,
            help="URDF of a robot: draft a urdf_robot with its joints.",
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite existing files.")] = False,
    settings: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            help="A key of [csv], for a table that is not read without: csv.header=false, csv.decimal=,",
            metavar="KEY=VALUE",
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Draft a machine file from a log, or with a folder as output also a benchmark file from several logs.

    Channels and units are guessed from names and numbers, groups from the ground truth; each guess is marked.

    Example: cdtool init stiff/*.csv --free 'free/*.csv' -o study
    """
    from cdtool.commands.init.drafting import init as draft
    from cdtool.commands.init.drafting import init_study
    from cdtool.commands.judging.settings_table import apply_settings, given_settings

    given = apply_settings({}, given_settings(settings or ()))
    csv = given.pop("csv", {})
    if given:
        raise UsageError(f"--set {next(iter(given))}: unknown key", "give a key of [csv], as csv.header=false")
    if csv and machine is not None:
        raise UsageError("--set and --machine: both state how tables are read", "write [csv] into the machine file")
    if output.suffix == ".toml":
        if len(logs) > 1 or machine is not None or free:
            what = "--machine" if machine is not None else "--free" if free else f"{len(logs)} logs"
            raise UsageError(f"--output is the file {output}, with {what}", "give a folder: -o study")
        with progress("analysing the log", pulses=True):
            drafted = draft(logs[0], output, force=force, csv=csv, urdf=urdf)
        if as_json:
            print_json(with_findings(drafted))
        else:
            typer.echo(drafted.text)
            first = "Check each line marked CHECK" if drafted.channels else "Add its channels"
            print_line(f"{plain(drafted.path)} written: a draft based on guesses. {first}, then run")
            typer.echo(f"  cdtool info {_quoted(logs[0])} --machine {_quoted(drafted.path)}")
        _warn(drafted)
        leave_with(drafted.findings)
        return
    if output.suffix and not output.is_dir():
        raise UsageError(f"--output is {plain(output)}", "give a machine file, NAME.toml, or a folder without a suffix")
    with progress("analysing the logs", pulses=True):
        study = init_study(logs, output, machine=machine, force=force, csv=csv, free=free or (), urdf=urdf)
    if as_json:
        print_json(asdict(study))
    else:
        _show(study, logs, output)
    if study.machine:
        _warn(study.machine)
    print_skipped(study.skipped)
    leave(study.skipped)


def _show(study: DraftedStudy, logs: list[Path], output: Path) -> None:
    from cdtool.commands.init.benchmark_draft import patterns

    typer.echo(study.text)
    names = [*([study.machine_path] if study.machine else []), study.path, *study.beside]
    print_line(
        f"{', '.join(map(plain, names))} written: drafts based on guesses. Check each line marked CHECK, then run"
    )
    typer.echo(f"  cdtool info {_quoted(logs[0])} --machine {_quoted(study.machine_path)}")
    for name in study.kept:
        print_line(f"{plain(name)} kept as it is: delete it for an empty one")
    if study.beside:
        print_line(f"fill in {', '.join(map(plain, study.beside))}, or map a load cell and draft the benchmark again:")
        some = " ".join("*".join(part and _quoted(part) for part in item.split("*")) for item in patterns(logs, Path()))
        typer.echo(f"  cdtool init {some} --machine {_quoted(study.machine_path)} -o {_quoted(output)} --force")
    if study.has_detectors:
        typer.echo(f"  cdtool benchmark {_quoted(study.path)} -o {_quoted(output / 'report.html')}")
    if not study.beside and not study.kept:
        print_line("for a test protocol of the contact forces:")
        typer.echo(f"  cdtool protocol init {_quoted(study.path)} -o {_quoted(output / 'protocol.toml')}")


def _warn(drafted: Drafted) -> None:
    """Print what is wrong with a draft to stderr."""
    if not drafted.channels:
        print_line(
            "warning: no column's name or values indicate a torque, speed or position: all are comments", err=True
        )
    for name in drafted.left_out:
        print_line(f"warning: {name}: the log contradicts the guess: written as a comment", err=True)
    for finding in drafted.findings:
        if finding.severity == "loss" or finding.kind == "steady_header":
            print_line(f"{finding.severity}: {plain(finding)}", err=True)


def _quoted(path: object) -> str:
    """Return a path quoted for a shell."""
    return shlex.quote(plain(path))
