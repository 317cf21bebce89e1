"""`cdtool init`."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated

import typer

from cdtool.cli.console import leave_with, plain, print_json, with_findings
from cdtool.cli.late_progress import late_progress
from cdtool.cli.options import JsonOption


def init(
    log: Annotated[Path, typer.Argument(help="A recording of the machine.", metavar="LOG")],
    output: Annotated[Path, typer.Option("--output", "-o", help="Machine file to write.")] = Path("machine.toml"),
    force: Annotated[bool, typer.Option("--force", help="Overwrite an existing file.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Draft a machine file from a log: channels and units guessed from names and numbers, each guess marked.

    Example: cdtool init sample_logs/gate/stiff/03.csv -o machine.toml
    """
    from cdtool.workflows.init.drafting import init as draft

    with late_progress("analysing the log"):
        drafted = draft(log, output, force=force)
    if as_json:
        print_json(with_findings(drafted))
    else:
        typer.echo(drafted.text)
        first = "Check each line marked CHECK" if drafted.channels else "Add its channels"
        typer.echo(f"{plain(drafted.path)} written: a draft based on guesses. {first}, then run")
        typer.echo(f"  cdtool info {_quoted(log)} --machine {_quoted(drafted.path)}")
    if not drafted.channels:
        typer.echo(
            "warning: no column's name or values indicate a torque, speed or position: all are comments", err=True
        )
    for name in drafted.left_out:
        typer.echo(f"warning: {name}: the log contradicts the guess: written as a comment", err=True)
    for finding in drafted.findings:
        if finding.severity == "loss":
            typer.echo(f"loss: {plain(finding)}", err=True)
    leave_with(drafted.findings)


def _quoted(path: object) -> str:
    """Return a path quoted for a shell."""
    return shlex.quote(plain(path))
