"""`cdtool store status|gc`."""

from __future__ import annotations

from dataclasses import asdict
from typing import Annotated

import typer
from rich.filesize import decimal

from cdtool.base.exit_status import statuses_words
from cdtool.base.plain_text import counted
from cdtool.commands.console.console import plain, print_json, print_line
from cdtool.commands.console.options import JsonOption
from cdtool.commands.console.place import Place, location

store = typer.Typer(
    help="Show what a store of benchmark outcomes contains, and remove what is no longer used.",
    no_args_is_help=True,
    rich_markup_mode=None,
)


@store.callback()
def _store() -> None:
    """Show what a store of benchmark outcomes contains, and remove what is no longer used."""


FolderArgument = Annotated[
    Place, typer.Argument(parser=location, help="Folder given to cdtool benchmark as --store.", metavar="DIR")
]


@store.command("status", epilog=statuses_words("store status"))
def status(folder: FolderArgument, as_json: JsonOption = False) -> None:
    """Show how many entries a store has, and its size.

    Example: cdtool store status outcomes
    """
    from cdtool.execution.store.upkeep import store_status

    found = store_status(folder)
    if as_json:
        print_json(asdict(found) | {"folder": str(found.folder)})
        return
    words = ", ".join(f"{count} {kind}" for kind, count in found.entries.items())
    print_line(f"{plain(found.folder)}: {words}; {decimal(found.bytes)}")


@store.command("gc", epilog=statuses_words("store gc"))
def gc(
    folder: FolderArgument,
    older_than: Annotated[
        float, typer.Option("--older-than", min=0.0, help="Days since its last use above which an entry is removed.")
    ] = 30.0,
) -> None:
    """Remove entries that no run has used for a time.

    Example: cdtool store gc outcomes --older-than 90
    """
    from cdtool.execution.store.upkeep import collect_garbage

    done = collect_garbage(folder, older_than_days=older_than)
    print_line(
        f"{plain(folder)}: {counted(done.removed, 'entry')} removed, {done.kept} kept; "
        f"{decimal(done.bytes_before)} before, {decimal(done.bytes_after)} now"
    )
