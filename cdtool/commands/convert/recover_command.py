"""`cdtool recover`."""

from __future__ import annotations

from typing import Annotated

import typer

from cdtool.base.exit_status import Fact
from cdtool.commands.console.console import leave, plain
from cdtool.commands.console.late_progress import late_progress
from cdtool.commands.console.options import QuietOption
from cdtool.commands.console.place import Place, location


def recover(
    log: Annotated[Place, typer.Argument(parser=location, help="A damaged or truncated MCAP file.", metavar="LOG")],
    output: Annotated[Place, typer.Option("--output", "-o", parser=location, help="The clean MCAP file to write.")],
    unverified: Annotated[
        bool, typer.Option("--unverified", help="Also keep messages without a checksum, marked as such.")
    ] = False,
    quiet: QuietOption = False,
    force: Annotated[bool, typer.Option("--force", help="Overwrite an existing file.")] = False,
) -> None:
    """Write the readable messages of a damaged MCAP file to a clean one, and report what was lost.

    Exits with status 3 if anything was lost or left out, and 0 if the file was intact.

    Example: cdtool recover log.mcap -o recovered.mcap
    """
    from cdtool.commands.convert.recovering import recover as write_what_is_left

    with late_progress("recovering", quiet=quiet) as advance:
        done = write_what_is_left(log, output, unverified, force=force, progress=advance)
    for finding in done.findings:
        typer.echo(f"{finding.severity}: {plain(finding)}")
    typer.echo(f"written: {plain(done.output)}: {done.messages} messages")
    if done.unverified:
        typer.echo(f"{done.unverified} of them have no checksum: their chunks have none")
    if done.left_out:
        typer.echo(f"left out: {done.left_out} messages without a checksum (--unverified keeps them)")
    leave(facts=() if done.whole else [Fact.LOST])
