"""`cdtool coverage`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated

import typer

from cdtool.base.plain_text import counted, digits
from cdtool.commands.console import completions
from cdtool.commands.console.colour import Toned
from cdtool.commands.console.console import leave, number, plain, print_json, print_skipped, progress, say, table
from cdtool.commands.console.options import (
    ClusterOption,
    ForceOption,
    JobsOption,
    JsonOption,
    QuietOption,
    SetOption,
    listed,
)
from cdtool.commands.console.place import Place, location

if TYPE_CHECKING:
    from cdtool.commands.inject.coverage.coverage import Coverage
    from cdtool.commands.inject.coverage.coverage_map import MapCell, TellingCell


def coverage(
    file: Annotated[
        Place,
        typer.Argument(
            parser=location,
            help="Benchmark file with a section [inject]; see docs/injection.md.",
            autocompletion=completions.files(".toml"),
        ),
    ],
    output: Annotated[
        list[Place] | None,
        typer.Option(
            "--output",
            "-o",
            parser=location,
            help="Output, repeatable: figure (.png, .svg, .pdf), .html (cells open trigger plots), .json.",
        ),
    ] = None,
    force: ForceOption = False,
    detectors: Annotated[
        str | None,
        typer.Option(
            "--detectors",
            help="Detectors instead of the file's, as gm,vo,eo.",
            autocompletion=completions.detector_list,
        ),
    ] = None,
    settings: SetOption = None,
    jobs: JobsOption = 1,
    cluster: ClusterOption = None,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Map where a machine notices contacts: latency, force and misses over position and stiffness of the obstacle.

    Example: cdtool coverage sample_logs/gate/inject.toml -o coverage.png -o coverage.html
    """
    from cdtool.commands.inject.coverage.coverage import coverage as run
    from cdtool.commands.inject.coverage.files import PAGE, check_coverage_files, coverage_summary, write_coverage
    from cdtool.commands.judging.settings_table import given_settings
    from cdtool.execution.workers import Workers

    targets = output or []
    check_coverage_files(targets, [file], force=force)
    with progress("coverage", quiet=quiet) as advance:
        done = run(
            file,
            detectors=listed(detectors or ""),
            with_traces=any(target.suffix.lower() == PAGE for target in targets),
            settings=given_settings(settings or ()),
            workers=Workers(jobs, cluster=cluster),
            progress=advance,
        )
    print_skipped(done.skipped, done.findings)
    write_coverage(done, targets)
    if as_json:
        print_json(coverage_summary(done))
    else:
        _show(done, quiet=quiet)
        for target in () if quiet else targets:
            typer.echo(f"written: {plain(target)}")
    leave(done.skipped)


def _show(done: Coverage, *, quiet: bool) -> None:
    from cdtool.commands.inject.coverage.page import coverage_counts, coverage_headline, coverage_tone

    if not quiet:
        _show_table(done)
    say(f"{coverage_headline(done.map)}: {coverage_counts(done.map)}", tone=coverage_tone(done.map))
    if not quiet:
        _show_telling(done)


def _show_table(done: Coverage) -> None:
    from cdtool.commands.inject.coverage.coverage_map import CellKey

    made = done.map
    by_speed = len(made.speeds) > 1
    rows = []
    for name, cells in made.cells.items():
        for stiffness in made.stiffnesses:
            for speed in made.speeds:
                keys = [CellKey(position, stiffness, speed.speed) for position in made.positions]
                here = [cells[key] for key in keys if key in cells]
                if here:
                    rows.append((name, _spring(stiffness), *([number(speed.speed)] if by_speed else []), *_row(here)))
    columns = [("detector", "left"), ("stiffness\nN/mm", "right")]
    columns += [(f"speed\n{made.speed_unit}", "right")] if by_speed else []
    columns += [("contacts", "right"), ("missed", "right"), ("latency\nms", "right"), ("force at alarm\nN", "right")]
    table(columns, rows)
    places = (
        f"{counted(len(made.positions), 'position')} from {made.positions[0]:g} to {made.positions[-1]:g} {made.unit}"
    )
    means = "least and greatest mean of the positions and brackets"
    say(f"{done.machine}: injected contacts at {places}; {means}")


def _show_telling(done: Coverage) -> None:
    made = done.map
    telling = made.most_telling()
    if telling:
        typer.echo("a test at the rig would tell most here:")
    for item in telling:
        speed_words = "" if item.key.speed is None else f", {item.key.speed:g} {made.speed_unit}"
        where = f"{item.key.position:g} {made.unit}, {_spring(item.key.stiffness)} N/mm{speed_words}"
        typer.echo(f"  {item.detector} at {where}: {_why(item)}")


def _row(cells: Sequence[MapCell]) -> tuple[object, ...]:
    latencies = [value for cell in cells for value in cell.range_ms if math.isfinite(value)]
    forces = [cell.force_n for cell in cells if math.isfinite(cell.force_n)]
    counts = (sum(cell.contacts for cell in cells), sum(cell.missed for cell in cells))
    return counts[0], Toned(counts[1], "bad" if counts[1] else ""), _range(latencies), _range(forces)


def _why(item: TellingCell) -> str:
    cell = item.cell
    if cell.missed:
        return f"{cell.missed} of {cell.assessable} missed"
    uncertain = f"+- {cell.uncertainty_ms:.0f} ms"
    return uncertain if cell.limit_ms is None else f"{uncertain}, limit {cell.limit_ms:g} ms"


def _spring(stiffness: float) -> str:
    return digits(float(f"{stiffness / 1e3:.3g}"))


def _range(values: list[float]) -> str:
    if not values:
        return "-"
    low, high = (digits(float(f"{value:.3g}")) for value in (min(values), max(values)))
    return low if low == high else f"{low} to {high}"
