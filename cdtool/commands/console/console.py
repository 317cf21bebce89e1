"""Output shared by the commands: messages on stderr, progress, tables that fit a terminal, plain text from files."""

from __future__ import annotations

import json
import math
import re
import shutil
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from pathlib import PurePath
from textwrap import fill
from time import perf_counter
from typing import TYPE_CHECKING, Any

import typer

from cdtool.base.errors import CdtoolError, MistakesError
from cdtool.base.exit_status import Fact, status_of
from cdtool.base.files.strict_json import strict_json
from cdtool.base.plain_text import LINE_LENGTH, LISTED, counted, one_line, reason_line, shorten_names, shorten_paths
from cdtool.base.plain_text import plain as plain
from cdtool.commands.console.colour import coloured, shows_colour, style_of

if TYPE_CHECKING:
    from rich.table import Table

    from cdtool.base.findings import Finding
    from cdtool.commands.detecting.detection import Detected
    from cdtool.execution.workers import Progress
    from cdtool.results.results import RecordingFinding, Skipped

_ERROR = "error: "
# Columns: a narrower terminal cannot show a table; longer lines are hard to read.
_NARROWEST, _WIDEST = 60, 100
# Gap between two columns [characters].
_GAP = 2


def print_error(fault: CdtoolError) -> None:
    """Print an error in one line of at most 300 characters: the problem, then the next step; before it, its notes.

    Several mistakes of a file have one line each.
    """
    if isinstance(fault, MistakesError):
        for mistake in fault.mistakes:
            print_error(mistake)
        return
    for note in getattr(fault, "__notes__", ()):
        print_line(one_line(note), err=True)
    message, hint = plain(fault.message), plain(fault.hint)
    room = LINE_LENGTH - len(_ERROR) - len(" ()")
    hint = shorten_names(hint, max(140, room - len(message)))  # the next step, about half of the line
    message = shorten_paths(message, room - len(hint))
    print_line(f"{_ERROR}{message}{f' ({hint})' if hint else ''}", err=True)


def print_line(text: str, *, err: bool = False) -> None:
    """Print a line to stdout or stderr; a terminal gets it wrapped at words, without splitting names."""
    if (sys.stderr if err else sys.stdout).isatty():
        indent = text[: len(text) - len(text.lstrip())]
        text = _wrapped(text.lstrip(), max(shutil.get_terminal_size().columns, _NARROWEST), indent)
    typer.echo(text, err=err)


def _wrapped(text: str, width: int, indent: str = "") -> str:
    more = f"{indent}  "
    return fill(
        text, width, initial_indent=indent, subsequent_indent=more, break_long_words=False, break_on_hyphens=False
    )


def print_json(value: Any) -> None:
    """Print strict JSON to stdout: NaN and infinity become null, characters missing from its encoding are escaped."""
    text = strict_json(value)
    try:
        text.encode(getattr(sys.stdout, "encoding", None) or "utf-8")
    except UnicodeEncodeError:
        text = json.dumps(json.loads(text), indent=1)
    typer.echo(text)


def with_findings(result: Any) -> dict[str, Any]:
    """Return a command's result as JSON values; its findings with their kinds, numbers and sentences."""
    return {**asdict(replace(result, findings=())), "findings": [finding.to_dict() for finding in result.findings]}


def print_skipped(skipped: Sequence[Skipped], findings: Sequence[RecordingFinding] = ()) -> None:
    """Print to stderr what was left out, what was lost, then warnings and notes, similar ones once."""
    _print_alike("left out", skipped)
    for severity in ("loss", "warning", "note"):
        _print_alike(severity, [item for item in findings if item.severity == severity])


def _print_alike(word: str, every: Sequence[Skipped | RecordingFinding]) -> None:
    if not every:
        return
    from cdtool.report.alike import alike

    items = alike([replace(item, reason=_bare(item)) for item in dict.fromkeys(every)])
    for item in items[:LISTED]:
        print_line(reason_line(word, item.recording, item.reason), err=True)
    if len(items) > LISTED:
        print_line(f"{word}: and {len(items) - LISTED} more", err=True)


def leave(
    skipped: Sequence[Skipped] = (), findings: Sequence[RecordingFinding] = (), facts: Iterable[Fact] = ()
) -> None:
    """Exit with the status of the facts and of left-out or damaged recordings; return if all is good."""
    logs = len({item.recording for item in findings if item.is_loss})
    items = len({item.recording for item in skipped})
    parts = [f"{counted(items, 'item', 'were')} left out"] if items else []
    parts += [f"{counted(logs, 'log', 'are')} damaged"] if logs else []
    facts = tuple(facts)
    if parts:
        start = "nothing can be used:" if Fact.NOTHING_USABLE in facts else "done, but"
        print_line(f"{start} {' and '.join(parts)}", err=True)
    found = [*facts, *([Fact.LEFT_OUT] if items else []), *([Fact.LOST] if logs else [])]
    status = status_of(found)
    if status:
        raise typer.Exit(status)


def leave_with(findings: Iterable[Finding], facts: Iterable[Fact] = ()) -> None:
    """Exit with the status of the facts and of findings that report a loss; return if all is good."""
    lost = any(finding.severity == "loss" for finding in findings)
    leave(facts=[*facts, *([Fact.LOST] if lost else [])])


def print_not_assessable(logs: Iterable[tuple[str, Detected]]) -> list[Fact]:
    """Print to stderr each log without an assessable operation or contact, with the reasons, and return the facts.

    As in `cdtool benchmark`, an alarm without a contact does not make a contact assessable.
    """
    facts: list[Fact] = []
    for name, found in logs:
        contacts = [row for rows in found.contact_rows for row in rows if row.outcome != "in_progress"]
        if all(item.verdict.outcome == "not_assessable" for item in found.detections):
            reasons = dict.fromkeys(item.verdict.reason for item in found.detections)
            words = "; ".join(reasons) or "it contains no operation"
        elif contacts and all(row.outcome == "not_assessable" for row in contacts):
            reasons = dict.fromkeys(row.reason or "unknown reason" for row in contacts)
            words = f"none of {counted(len(contacts), 'contact')} could be assessed: {'; '.join(reasons)}"
        else:
            continue
        print_line(f"not assessable: {plain(name)}: {plain(words)}", err=True)
        facts.append(Fact.NOTHING_ASSESSABLE)
    return facts


def say(text: str, indent: str = "", tone: str = "") -> None:
    """Print a sentence to stdout in lines that fit the terminal; names are not split. `tone`: its colour."""
    typer.echo(coloured(_wrapped(plain(text), columns_to_fill(), indent), tone), color=shows_colour())


def columns_to_fill() -> int:
    """Return the terminal's width, 60 to 100; 100 without a terminal, so that redirected output is reproducible."""
    if not sys.stdout.isatty():
        return _WIDEST
    return min(max(shutil.get_terminal_size().columns, _NARROWEST), _WIDEST)


def table(columns: Sequence[tuple[str, str]], rows: Sequence[Sequence[object]], title: str = "") -> None:
    """Print a table: columns as (heading, "left" or "right"); cells are text or `Toned`; an empty column is left out.

    The first left-aligned columns name a row. Columns that do not fit follow below, with the names repeated.
    """
    from rich.console import Console
    from rich.table import Table as RichTable
    from rich.text import Text

    kept = [i for i in range(len(columns)) if not rows or any(str(row[i]) for row in rows)]
    shown = [columns[i] for i in kept]
    cells = [[plain(row[i]) for i in kept] for row in rows]
    styles = [[style_of(row[i]) for i in kept] for row in rows]
    widths = _widths(shown, cells)
    width = _room(widths)
    for number, block in enumerate(column_blocks(widths, width)):
        made: Table = RichTable(
            box=None, title=title or None, title_justify="left", title_style="bold", padding=(0, _GAP, 0, 0)
        )
        made.pad_edge = False
        fits = sum(widths[i].needed + _GAP for i in block) <= width + _GAP
        for i in block:
            heading, side = shown[i]
            is_right = side == "right"
            made.add_column(
                heading, justify="right" if is_right else "left", overflow="fold", no_wrap=fits and _stays(widths[i])
            )
        for row, looks in zip(cells, styles, strict=True):
            made.add_row(*(Text(row[i], style=looks[i]) for i in block))
        if number:
            typer.echo()
        Console(width=width, highlight=False, no_color=not shows_colour()).print(made)


def fits_terminal(columns: Sequence[tuple[str, str]], rows: Sequence[Sequence[object]]) -> bool:
    """Return whether `table` shows all columns side by side; always without a terminal."""
    widths = _widths(columns, [[plain(cell) for cell in row] for row in rows])
    return len(column_blocks(widths, _room(widths))) == 1


def _widths(columns: Sequence[tuple[str, str]], cells: Sequence[Sequence[str]]) -> list[ColumnWidth]:
    first = next((i for i, (_, side) in enumerate(columns) if side == "right"), len(columns))
    return [
        column_width(heading, side, [row[i] for row in cells], i < first) for i, (heading, side) in enumerate(columns)
    ]


def _room(widths: Sequence[ColumnWidth]) -> int:
    """Return the width of the terminal. A pipe or a log file has none: columns are neither folded nor moved there."""
    if sys.stdout.isatty():
        return max(shutil.get_terminal_size().columns, _NARROWEST)
    # In a pipe nothing wraps: a file has wide lines.
    return max(160, sum(item.needed + _GAP for item in widths))


def _stays(column: ColumnWidth) -> bool:
    """Whether a column never wraps because its needed width is its natural width."""
    return column.needed == column.natural


def number(value: float | None, digits: int = 3) -> str:
    """Return a number for a table, or a dash if it is missing or not finite."""
    if value is None or not math.isfinite(value):
        return "-"
    text = f"{value:.{digits}g}"
    return f"{value:.0f}" if "e+" in text and abs(value) < 1e15 else text


@contextmanager
def progress(what: str, *, pulses: bool = False, quiet: bool = False) -> Iterator[Progress | None]:
    """Show a progress bar on stderr; yield None and draw nothing if stderr is not a terminal, or if `quiet`.

    `pulses`: it moves while the total is unknown, drawn by a thread. Otherwise it is drawn only as the work advances:
    with another thread in this process, the processes of --jobs could not be forked (execution/processes.py).
    """
    if quiet or not sys.stderr.isatty():
        yield None
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Bar(*columns, console=Console(stderr=True), transient=True, auto_refresh=pulses) as bar:
        task = bar.add_task(what, total=None)
        drawn = -math.inf

        def advance(done: int, total: int) -> None:
            nonlocal drawn
            now = perf_counter()
            is_due = not pulses and (now - drawn > 0.1 or done == total)  # s: more is not seen
            drawn = now if is_due else drawn
            bar.update(task, completed=done, total=total, refresh=is_due)

        bar.refresh()
        yield advance


def _bare(item: Skipped | RecordingFinding) -> str:
    """Return a reason without the recording, which the line already names."""
    return re.sub(rf"^[^:]*{re.escape(PurePath(item.recording).name)}: ", "", item.reason)


@dataclass(frozen=True)
class ColumnWidth:
    """The width of a column: `needed` characters at least (sentences wrap at words), `natural` for its longest cell."""

    is_name: bool
    needed: int
    natural: int


def column_width(heading: str, side: str, cells: Sequence[str], leading: bool) -> ColumnWidth:
    """Return the width of a column; a left-aligned one that is not `leading` contains sentences."""
    lines = [*heading.split("\n"), *cells]
    natural = max(map(len, lines), default=0)
    if side == "right" or leading:
        return ColumnWidth(leading, natural, natural)
    words = max((len(word) for line in lines for word in line.split()), default=0)
    # Sentences wrap at words, but not to a narrower column.
    return ColumnWidth(False, max(words, min(natural, 30)), natural)


def column_blocks(columns: Sequence[ColumnWidth], width: int) -> list[list[int]]:
    """Return the columns of each of the stacked tables: the names in each, then as many others as fit."""
    names = [i for i, column in enumerate(columns) if column.is_name]
    base = sum(columns[i].needed + _GAP for i in names)
    made: list[list[int]] = []
    room = 0
    for i, column in enumerate(columns):
        if i in names:
            continue
        if not made or column.needed + _GAP > room:
            made.append(list(names))
            room = width + _GAP - base  # no gap follows the last column
        made[-1].append(i)
        room -= column.needed + _GAP
    return made or [list(names)]
