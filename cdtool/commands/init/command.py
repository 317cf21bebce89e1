"""`cdtool init`."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cdtool.base.errors import UsageError
from cdtool.base.plain_text import counted
from cdtool.commands.console.console import (
    leave,
    leave_with,
    plain,
    print_json,
    print_line,
    print_next,
    print_skipped,
    progress,
    say,
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
            _show_draft(drafted.path, drafted.text)
            print_next("cdtool", "info", logs[0], "--machine", drafted.path)
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

    if study.machine:
        _show_draft(study.machine.path, study.machine.text)
    _show_draft(study.path, study.text)
    for name in study.kept:
        print_line(f"{plain(name)} kept as it is: delete it for an empty one")
    print_next("cdtool", "info", logs[0], "--machine", study.machine_path)
    if study.beside:
        print_line(f"then: fill in {', '.join(map(plain, study.beside))}, or map a load cell and draft again:")
        again = ("--machine", study.machine_path, "-o", output, "--force")
        print_next("cdtool", "init", *patterns(logs, Path()), *again, first="then")
    if study.has_detectors:
        print_next("cdtool", "benchmark", study.path, "-o", output / "report.html", first="then")
    if not study.beside and not study.kept:
        print_next("cdtool", "protocol", "init", study.path, "-o", output / "protocol.toml", first="then")


def _show_draft(path: str, text: str) -> None:
    """Print how many lines of a draft are to be checked, and its lines without the reasons that are in its comments."""
    lines: list[str] = []
    marked = False
    for line in text.splitlines():
        marked = marked or "CHECK:" in line
        if line.startswith("#"):
            continue
        code = line.partition("  # ")[0]
        if code or (lines and lines[-1]):
            lines.append(f"{code}  # CHECK" if marked and code else code)
        marked = False
    marks = counted(sum(line.endswith("# CHECK") for line in lines), "line")
    say(f"{path}: a draft based on guesses, {marks} to be checked; its comments have the reasons")
    typer.echo()
    for line in lines:
        print_line(f"  {plain(line)}" if line else "")
    typer.echo()


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
