"""`cdtool store status|gc`."""

from __future__ import annotations

from dataclasses import asdict
from datetime import datetime
from typing import Annotated

import typer
from rich.filesize import decimal

from cdtool.base.exit_status import statuses_words
from cdtool.base.plain_text import counted
from cdtool.commands.console.console import plain, print_json, table
from cdtool.commands.console.options import JsonOption
from cdtool.commands.console.place import Place, location

store = typer.Typer(
    help="Show what a store of benchmark outcomes contains, and remove what is no longer used.",
    no_args_is_help=True,
    rich_markup_mode="markdown",
)
# Runs that are shown.
_SHOWN = 10


@store.callback()
def _store() -> None:
    """Show what a store of benchmark outcomes contains, and remove what is no longer used."""


FolderArgument = Annotated[
    Place, typer.Argument(parser=location, help="Folder given to cdtool benchmark as --store.", metavar="DIR")
]


@store.command("status", epilog=statuses_words("store status"))
def status(folder: FolderArgument, as_json: JsonOption = False) -> None:
    """Show the entries of a store, its size, and its finished runs.

    Example: cdtool store status outcomes
    """
    from cdtool.execution.store.upkeep import store_status

    found = store_status(folder)
    if as_json:
        print_json(asdict(found) | {"folder": str(found.folder)})
        return
    could_not = f", {found.failed} of which could not be read" if found.failed else ""
    typer.echo(f"{plain(found.folder)}: {counted(found.recordings, 'recording')}{could_not}, {decimal(found.bytes)}")
    kinds = ", ".join(f"{number} of kind {kind}" for kind, number in found.entries.items())
    typer.echo(f"entries: {kinds or 'none'}")
    if found.unused:
        typer.echo(f"not used by any finished run: {found.unused} (cdtool store gc removes them when they are old)")
    for name in found.damaged:
        typer.echo(f"damaged, not used: {plain(name)}")
    if not found.runs:
        typer.echo("no run has finished")
        return
    rows = [
        (
            datetime.fromtimestamp(run.ended).strftime("%Y-%m-%d %H:%M"),
            run.benchmark,
            run.recordings,
            run.computed,
            run.failed,
            f"{run.ended - run.began:.0f} s",
        )
        for run in found.runs[:_SHOWN]
    ]
    columns = [("ended", "left"), ("benchmark", "left"), ("recordings", "right"), ("computed", "right")]
    table([*columns, ("not read", "right"), ("time", "right")], rows)
    if len(found.runs) > _SHOWN:
        typer.echo(f"and {counted(len(found.runs) - _SHOWN, 'earlier run')}")


@store.command("gc", epilog=statuses_words("store gc"))
def gc(
    folder: FolderArgument,
    keep_runs: Annotated[
        int, typer.Option("--keep-runs", min=0, help="Runs, the newest, whose entries are kept.")
    ] = 10,
    older_than: Annotated[
        float, typer.Option("--older-than", min=0.0, help="Age in days above which unused entries are removed.")
    ] = 7.0,
    as_json: JsonOption = False,
) -> None:
    """Remove entries that none of the newest runs used, and write the others to fewer files.

    Example: cdtool store gc outcomes --keep-runs 5
    """
    from cdtool.execution.store.upkeep import collect_garbage

    done = collect_garbage(folder, keep_runs=keep_runs, older_than_days=older_than)
    if as_json:
        print_json(asdict(done))
        return
    typer.echo(
        f"{plain(folder)}: {counted(done.removed, 'entry')} removed, {done.kept} kept; "
        f"{counted(done.files_before, 'file')}, {decimal(done.bytes_before)} before; "
        f"{counted(done.files_after, 'file')}, {decimal(done.bytes_after)} now"
    )
