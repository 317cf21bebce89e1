"""`cdtool recover`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cdtool.cli.console import leave, plain
from cdtool.cli.late_progress import late_progress
from cdtool.exit_status import Fact


def recover(
    log: Annotated[Path, typer.Argument(help="A damaged or cut MCAP file.", metavar="LOG")],
    output: Annotated[Path, typer.Option("--output", "-o", help="The clean MCAP file to write.")],
    unverified: Annotated[
        bool, typer.Option("--unverified", help="Also keep messages that no checksum covers, marked as such.")
    ] = False,
    force: Annotated[bool, typer.Option("--force", help="Overwrite an existing file.")] = False,
) -> None:
    """Write what is left of a damaged MCAP file as a clean one, and say what was lost.

    Ends with status 3 where something was lost or left out, 0 where the file was whole.

    Example: cdtool recover log.mcap -o recovered.mcap
    """
    from cdtool.workflows.recovering import recover as write_what_is_left

    with late_progress("recovering") as advance:
        done = write_what_is_left(log, output, unverified, force=force, progress=advance)
    for finding in done.findings:
        typer.echo(f"{finding.severity}: {plain(finding)}")
    typer.echo(f"written: {plain(done.output)}: {done.messages} messages")
    if done.unverified:
        typer.echo(f"{done.unverified} of them no checksum covers: in chunks without one")
    if done.left_out:
        typer.echo(f"left out: {done.left_out} messages that no checksum covers (--unverified keeps them)")
    leave(facts=() if done.whole else [Fact.LOST])
