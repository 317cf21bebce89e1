"""`cdtool compare`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from cdtool.base.exit_status import Fact
from cdtool.base.plain_text import LISTED, shorten
from cdtool.commands.console.console import detector_table, leave, print_written, say
from cdtool.commands.console.options import ForceOption, JsonOption, QuietOption
from cdtool.commands.console.place import Place, location
from cdtool.report.table import shown

if TYPE_CHECKING:
    from cdtool.commands.compare.comparison import BuildComparison
    from cdtool.commands.compare.questions import Figure
    from cdtool.commands.compare.rows import BuildRow

# Longest names in the table [characters]: the other columns need the rest of the line.
_LONGEST_GROUP, _LONGEST_DETECTOR = 11, 17
# The colours of outcomes.
_TONES = {"worse": "bad", "mixed": "bad", "better": "good", "inconclusive": "unknown"}


def compare(
    old: Annotated[
        Place,
        typer.Argument(
            parser=location,
            help="results.json or results.parquet of the old build.",
            metavar="OLD",
        ),
    ],
    new: Annotated[
        Place,
        typer.Argument(
            parser=location,
            help="results.json or results.parquet of the new build.",
            metavar="NEW",
        ),
    ],
    level: Annotated[
        float, typer.Option("--level", help="Family-wise error rate: chance of any wrong 'worse' or 'better'.")
    ] = 0.05,
    relevant_change: Annotated[
        float,
        typer.Option(
            "--relevant-change",
            help="Smallest deterioration that matters: a share of the old mean latency and force, of the "
            "contacts missed or not assessable, and of a false alarm per operation.",
        ),
    ] = 0.1,
    require_power: Annotated[
        bool,
        typer.Option(
            "--require-power",
            help="Exit with status 4 if the recordings could not have shown a relevant change, or if a detector "
            "or group is missing from the new file.",
        ),
    ] = False,
    fail_if_later: Annotated[
        bool,
        typer.Option(
            "--fail-if-later",
            help="Exit with status 1 if the new build is later on the same contacts by --relevant-change, or misses "
            "more of them, whatever this shows about other recordings.",
        ),
    ] = False,
    output: Annotated[
        list[Place] | None,
        typer.Option(
            "--output", "-o", parser=location, help="Output file, repeatable: .md (for a pull request), .json."
        ),
    ] = None,
    force: ForceOption = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Compare two builds and separate real changes from noise: latency, misses, false alarms, force at the alarm.

    Contacts in both files are compared one by one. Exits with status 1 if anything is shown to be worse. If a relevant
    change could not have been shown, the result is "inconclusive": status 0, or 4 with --require-power. What happened
    on the same contacts is listed in any case.

    Example: cdtool compare old.json new.json -o compare.md
    """
    from cdtool.base.files.foreign import refuse_inputs
    from cdtool.commands.compare.comparison import compare as run
    from cdtool.commands.compare.comparison_json import to_json
    from cdtool.report.outputs import check_outputs, write_outputs

    targets = output or []
    refuse_inputs(targets, (old, new))
    check_outputs(targets, force=force, subject="comparison")
    found = run(old, new, significance=level, relevant_change=relevant_change)
    write_outputs(found, targets, force=True, inputs=(old, new), subject="comparison")
    if as_json:
        typer.echo(to_json(found), nl=False)
    else:
        _show(found, quiet=quiet, fail_if_later=fail_if_later)
        print_written(() if quiet else targets)
    later = {Fact.LATER} if fail_if_later and found.later else set()
    leave(facts={*(found.facts if require_power else set(found.facts) & {Fact.WORSE}), *later})


def _show(found: BuildComparison, *, quiet: bool, fail_if_later: bool) -> None:
    """Print the verdict, what is missing from one file, the numbers, each row in words, and the differences.

    If `quiet`, of the rows only those that are worse, and no table.
    """
    tone = _TONES.get(found.verdict, "good")
    if found.later and tone != "bad":
        tone = "bad" if fail_if_later else "unknown"
    say(found.words, tone=tone)
    if not quiet:
        typer.echo()
    for which, names in (("old", found.only_old), ("new", found.only_new)):
        for name in names:
            say(f"only in {which}, not compared: {name}")
    if not quiet:
        _show_table(found)
    _show_rows([row for row in found.rows if not quiet or _TONES.get(row.outcome) == "bad"])
    if not quiet:
        _show_differences(found)


def _show_table(found: BuildComparison) -> None:
    from cdtool.commands.compare.comparison_model import both, contacts_of
    from cdtool.detectors import DETECTORS
    from cdtool.report.number_text import NOTHING

    heads = ("contacts", "latency\nms", "missed", "not\nassessable", "false\nalarms", "force at\nalarm N")
    columns = [("group", "left"), ("detector", "left"), *((name, "right") for name in heads)]
    figures: tuple[Figure, ...] = ("missed", "not_assessable", "false_alarms", "force_at_alarm_n")
    rows = [
        (
            shorten(shown(row.group), _LONGEST_GROUP),
            shorten(row.detector, _LONGEST_DETECTOR),
            contacts_of(row),
            both(row, "latency_ms"),
            *(both(row, figure) for figure in figures),
        )
        for row in found.rows
    ]
    assessed = all(row[5] in (NOTHING, "0 / 0") for row in rows)  # an empty column is left out
    cells = [(*row[:5], "" if assessed else row[5], *row[6:]) for row in rows]
    used = detector_table(columns, cells, {name: brief for brief, name in DETECTORS.short_names.items()})
    if used:
        say("; ".join(f"{brief}: {name}" for brief, name in DETECTORS.short_names.items() if name in used))
    say("old / new, or one number for both; latency: mean, or median below ten contacts")
    typer.echo()


def _show_rows(rows: Sequence[BuildRow]) -> None:
    for rows_alike in _alike(rows):
        first = rows_alike[0]
        alike = ", ".join(shorten(row.detector, 2 * _LONGEST_DETECTOR) for row in rows_alike)
        where = f"{shorten(shown(first.group), 2 * _LONGEST_GROUP)}, {alike}"
        say(f"{where}: {first.words}", tone=_TONES.get(first.outcome, ""))


def _show_differences(found: BuildComparison) -> None:
    for item in found.changed[:LISTED]:
        say(f"differs: {item.key}: {item.old}, now {item.new}")
    if len(found.changed) > LISTED:
        say(f"differs: and {len(found.changed) - LISTED} more settings")
    for note in found.notes:
        say(note)


def _alike(rows: Sequence[BuildRow]) -> list[list[BuildRow]]:
    """Return the rows of each group with the same words: they are printed once."""
    found: dict[tuple[str, str], list[BuildRow]] = {}
    for row in rows:
        found.setdefault((row.group, row.words), []).append(row)
    return list(found.values())
