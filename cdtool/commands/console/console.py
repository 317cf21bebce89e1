"""Output shared by the commands: messages on stderr, progress, tables that fit a terminal, plain text from files."""

from __future__ import annotations

import json
import math
import os
import re
import shlex
import shutil
import sys
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass, replace
from itertools import zip_longest
from pathlib import Path, PurePath
from textwrap import TextWrapper, wrap
from typing import TYPE_CHECKING, Any

import typer

from cdtool.base.errors import CdtoolError, MistakesError
from cdtool.base.exit_status import Fact, status_of
from cdtool.base.files.strict_json import strict_json
from cdtool.base.plain_text import LINE_LENGTH, LISTED, counted, one_line, reason_line, shorten_names, shorten_paths
from cdtool.base.plain_text import plain as plain
from cdtool.commands.console.colour import coloured
from cdtool.commands.console.streams import Pace
from cdtool.report.number_text import NOTHING

if TYPE_CHECKING:
    from cdtool.base.findings import Finding
    from cdtool.commands.detecting.detection import Detected
    from cdtool.execution.workers import Progress
    from cdtool.results.results import RecordingFinding, Skipped

_ERROR = "error: "
# The first word of a line that says how bad it is.
_TONES = {"error": "bad", "loss": "unknown", "warning": "unknown", "left out": "unknown", "not assessable": "unknown"}
# Columns: a narrower terminal cannot show a table; longer lines are hard to read.
_NARROWEST, _WIDEST = 60, 120
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
    stream = sys.stderr if err else sys.stdout
    if stream.isatty():
        text = _wrapped(text, max(shutil.get_terminal_size().columns, _NARROWEST))
    word, colon, rest = text.partition(":")
    typer.echo(coloured(word, _TONES.get(word, ""), stream) + colon + rest, err=err, color=True)


def print_next(*words: object, first: str = "next") -> None:
    """Print a command to run next, quoted for a shell; on a terminal it continues on lines that fit."""
    # The stars of a pattern are for the shell.
    lines = [" ".join("*".join(part and shlex.quote(part) for part in plain(word).split("*")) for word in words)]
    if sys.stdout.isatty() and os.name != "nt":  # the shells of Windows continue lines in other ways
        width = columns_to_fill() - len(first) - len(":  \\")
        together = re.sub(r" (-\S+) ", " \\1\xa0", lines[0])  # an option and its value
        lines = wrap(together, width, break_long_words=False, break_on_hyphens=False)
    typer.echo(f"{first}: " + f" \\\n{' ' * (len(first) + 2)}".join(lines).replace("\xa0", " "))


def print_written(targets: Iterable[Path], first: str = "report.html") -> None:
    """Print the files that were written, and of a folder how many it has and which one to open first."""
    for target in targets:
        if target.is_dir() and (target / first).exists():
            files = counted(sum(1 for _ in target.iterdir()), "file")
            print_line(f"{files} in {plain(target)}/; open {plain(target / first)}")
        else:
            print_line(f"written: {plain(target)}")


def _wrapped(text: str, width: int) -> str:
    indent = " " * (len(text) - len(text.lstrip()))
    wrapper = TextWrapper(width, indent, f"{indent}  ", break_long_words=False, break_on_hyphens=False)
    return wrapper.fill(text.lstrip())


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
    typer.echo(coloured(_wrapped(indent + plain(text), columns_to_fill()), tone), color=True)


def columns_to_fill() -> int:
    """Return the width of sentences: the terminal's, 60 to 120; 100 without a terminal."""
    if not sys.stdout.isatty():
        return 100  # of redirected sentences, which are the same on every machine
    return min(max(shutil.get_terminal_size().columns, _NARROWEST), _WIDEST)


def table(columns: Sequence[tuple[str, str]], rows: Sequence[Sequence[object]], title: str = "") -> None:
    """Print a table: columns as (heading, "left" or "right"); cells are text or `Toned`; an empty column is left out.

    The first left-aligned columns name a row. Columns that do not fit follow below, with the names repeated.
    """
    kept = [i for i in range(len(columns)) if not rows or any(str(row[i]) for row in rows)]
    shown = [columns[i] for i in kept]
    cells = [[plain(row[i]).replace(NOTHING, "-") for i in kept] for row in rows]
    tones = [[getattr(row[i], "tone", "") for i in kept] for row in rows]
    widths = _widths(shown, cells)
    width = _room(widths)
    if title:
        say(title, tone="heading")
    for number, block in enumerate(column_blocks(widths, width)):
        if number:
            typer.echo()
        sizes = _sizes([widths[i] for i in block], width)
        sides = [shown[i][1] for i in block]
        headings = [shown[i][0].split("\n")[::-1] for i in block]
        for line in [*zip_longest(*headings, fillvalue="")][::-1]:
            _print_row(line, sizes, sides, ["heading"] * len(block))
        for row, looks in zip(cells, tones, strict=True):
            parts = [wrap(row[i], size, break_on_hyphens=False) for i, size in zip(block, sizes, strict=True)]
            for line in zip_longest(*parts, fillvalue=""):
                _print_row(line, sizes, sides, [looks[i] for i in block])


def _sizes(columns: Sequence[ColumnWidth], width: int) -> list[int]:
    """Return the widths of columns side by side: sentences share what the others leave, long names are folded."""
    sizes = [column.needed for column in columns]
    left = width + _GAP - sum(size + _GAP for size in sizes)
    for _ in range(-left):
        sizes[sizes.index(max(sizes))] -= 1
    for i, column in enumerate(columns if left > 0 else ()):
        sizes[i] += min(left, column.natural - column.needed)
        left -= sizes[i] - column.needed
    return sizes


def _print_row(cells: Sequence[str], sizes: Sequence[int], sides: Sequence[str], tones: Sequence[str]) -> None:
    parts = []
    for text, size, side, tone in zip(cells, sizes, sides, tones, strict=True):
        padding = " " * (size - len(text))
        parts.append(padding + coloured(text, tone) if side == "right" else coloured(text, tone) + padding)
    typer.echo((" " * _GAP).join(parts).rstrip(), color=True)


def detector_table(
    columns: Sequence[tuple[str, str]], rows: Sequence[Sequence[Any]], short: Mapping[str, str]
) -> set[str]:
    """Print a table with a detector in its second column; return those that have their short names in it.

    They have if the columns do not fit side by side, never without a terminal.
    """
    widths = _widths(columns, [[plain(cell) for cell in row] for row in rows])
    is_narrow = len(column_blocks(widths, _room(widths))) > 1
    used = {row[1] for row in rows} & set(short) if is_narrow else set()
    table(columns, [[row[0], short[row[1]] if row[1] in used else row[1], *row[2:]] for row in rows])
    return used


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


def number(value: float | None, digits: int = 3) -> str:
    """Return a number for a table, or a dash if it is missing or not finite."""
    if value is None or not math.isfinite(value):
        return "-"
    text = f"{value:.{digits}g}"
    return f"{value:.0f}" if "e+" in text and abs(value) < 1e15 else text


@contextmanager
def progress(what: str, *, pulses: bool = False, quiet: bool = False) -> Iterator[Progress | None]:
    """Show a progress bar on stderr, or a line per minute if stderr is not a terminal; `quiet`: yield None.

    `pulses`: it moves while the total is unknown, drawn by a thread. Otherwise it is drawn only as the work advances:
    with another thread in this process, the processes of --jobs could not be forked (execution/processes.py).
    """
    if quiet:
        yield None
        return
    if not sys.stderr.isatty():
        pace = Pace()
        yield lambda done, total: pace.show(f"{what}: {done} of {total}")
        return
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Bar(*columns, console=Console(stderr=True), transient=True, auto_refresh=pulses) as bar:
        task = bar.add_task(what, total=None)
        pace = Pace(0.1)  # s: more is not seen

        def advance(done: int, total: int) -> None:
            is_due = not pulses and (done == total or pace.is_due())
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
