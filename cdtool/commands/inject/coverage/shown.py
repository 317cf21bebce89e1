"""The map of `cdtool inject` on the screen."""

from __future__ import annotations

import math
from collections.abc import Sequence

from cdtool.base.plain_text import counted, digits
from cdtool.commands.console.colour import Toned
from cdtool.commands.console.console import number, print_line, print_skipped, say, table
from cdtool.commands.inject.coverage.coverage import Coverage
from cdtool.commands.inject.coverage.coverage_map import CellKey, MapCell, TellingCell
from cdtool.commands.inject.coverage.page import coverage_counts, coverage_headline, coverage_tone, in_n_per_mm


def show_coverage(done: Coverage, *, quiet: bool) -> None:
    """Print the headline and what was left out, and unless `quiet` the map and where a test would tell most."""
    say(f"{coverage_headline(done.map)}: {coverage_counts(done.map)}", tone=coverage_tone(done.map))
    print_skipped(done.skipped, done.findings)
    if not quiet:
        _show_table(done)
        _show_telling(done)


def _show_table(done: Coverage) -> None:
    made = done.map
    by_speed = len(made.speeds) > 1
    rows = []
    for name, cells in made.cells.items():
        for stiffness in made.stiffnesses:
            for speed in made.speeds:
                keys = [CellKey(position, stiffness, speed.speed) for position in made.positions]
                here = [cells[key] for key in keys if key in cells]
                if here:
                    rows.append(
                        (name, in_n_per_mm(stiffness), *([number(speed.speed)] if by_speed else []), *_row(here))
                    )
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
        print_line("a test at the rig would tell most here:")
    for item in telling:
        speed_words = "" if item.key.speed is None else f", {item.key.speed:g} {made.speed_unit}"
        where = f"{item.key.position:g} {made.unit}, {in_n_per_mm(item.key.stiffness)} N/mm{speed_words}"
        print_line(f"  {item.detector} at {where}: {_why(item)}")


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


def _range(values: list[float]) -> str:
    if not values:
        return "-"
    low, high = (digits(float(f"{value:.3g}")) for value in (min(values), max(values)))
    return low if low == high else f"{low} to {high}"
