"""What commands share: messages on stderr, progress, tables that fit a terminal, plain text from files."""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import typer

from cdtool.errors import CdtoolError, ExitStatus
from cdtool.evaluation.results import Skipped
from cdtool.plain_text import plain as plain
from cdtool.strict_json import strict_json

if TYPE_CHECKING:
    from rich.table import Table

    from cdtool.workflows.runs import Progress

_SHOWN = 10


def print_error(fault: CdtoolError) -> None:
    """One line: what is wrong, then the next step."""
    hint = f" ({plain(fault.hint)})" if fault.hint else ""
    typer.echo(f"error: {plain(fault.message)}{hint}", err=True)


def print_json(value: Any) -> None:
    """Strict JSON on stdout; NaN and infinity are null."""
    typer.echo(strict_json(value))


def print_skipped(skipped: Sequence[Skipped], findings: Sequence[Skipped] = ()) -> None:
    """On stderr what was left out and why, then warnings; long lists are cut and counted."""
    for items, word in ((skipped, "left out"), (findings, "warning")):
        for item in items[:_SHOWN]:
            typer.echo(f"{word}: {plain(item.recording)}: {plain(_without_name(item))}", err=True)
        if len(items) > _SHOWN:
            typer.echo(f"{word}: and {len(items) - _SHOWN} more", err=True)


def leave(skipped: Sequence[Skipped]) -> None:
    """End with status 3 where something was left out."""
    if skipped:
        count = len(skipped)
        typer.echo(f"done, but {count} {'item was' if count == 1 else 'items were'} left out", err=True)
        raise typer.Exit(ExitStatus.INCOMPLETE)


def table(columns: Sequence[tuple[str, str]], rows: Sequence[Sequence[object]], title: str = "") -> None:
    """Print a table: columns as (heading, "left" or "right"); cells are plain text; an empty column is left out."""
    from rich.console import Console
    from rich.table import Table as RichTable
    from rich.text import Text

    kept = [i for i in range(len(columns)) if not rows or any(str(row[i]) for row in rows)]
    made: Table = RichTable(
        box=None, title=title or None, title_justify="left", title_style="bold", padding=(0, 2, 0, 0)
    )
    for i in kept:
        heading, side = columns[i]
        made.add_column(heading, justify="right" if side == "right" else "left", overflow="fold")
    for row in rows:
        made.add_row(*(Text(plain(row[i])) for i in kept))
    # A pipe or a log file has no width: long names must not be folded there.
    width = None if sys.stdout.isatty() else 160
    Console(width=width, highlight=False).print(made)


def number(value: float | None, digits: int = 3) -> str:
    """A figure for a table; a dash where there is none."""
    if value is None or not math.isfinite(value):
        return "-"
    text = f"{value:.{digits}g}"
    return f"{value:.0f}" if "e+" in text and abs(value) < 1e15 else text


@contextmanager
def progress(what: str) -> Iterator[Progress | None]:
    """A progress bar on stderr; None, and nothing drawn, where stderr is not a terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Bar(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def _without_name(item: Skipped) -> str:
    return item.reason.removeprefix(f"{item.recording}: ")
