"""`cdtool coverage`."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cdtool.cli import completions
from cdtool.cli.console import leave, plain, print_json, print_skipped, progress, table
from cdtool.cli.options import ClusterOption, ForceOption, JobsOption, JsonOption, RetriesOption, TimeoutOption, listed
from cdtool.cli.place import Place, location
from cdtool.errors import UsageError
from cdtool.plain_text import counted, digits

if TYPE_CHECKING:
    from cdtool.workflows.coverage import Coverage


def coverage(
    file: Annotated[
        Place,
        typer.Argument(parser=location, help="Benchmark file with a section [inject]; see docs/injection.md."),
    ],
    output: Annotated[
        Place | None, typer.Option("--output", "-o", parser=location, help="Figure to draw: .png, .svg or .pdf.")
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
    jobs: JobsOption = 1,
    cluster: ClusterOption = None,
    timeout: TimeoutOption = None,
    retries: RetriesOption = 1,
    as_json: JsonOption = False,
) -> None:
    """Map where a machine notices contacts: latency, force and misses over position and stiffness of the obstacle.

    Example: cdtool coverage sample_logs/gate/inject.toml -o coverage.png
    """
    from cdtool.workflows.coverage import coverage as run
    from cdtool.workflows.execution.workers import Workers

    if output:
        from cdtool.foreign_files import refuse_foreign_figure
        from cdtool.report.plots.figures import SUFFIXES

        if output.suffix.lower() not in SUFFIXES:
            raise UsageError(f"--output is '{output}'", f"the name must end in {', '.join(SUFFIXES)}")
        refuse_foreign_figure(output, force=force)
    with progress("coverage") as advance:
        done = run(
            file,
            detectors=listed(detectors or ""),
            workers=Workers(jobs, timeout, retries, cluster),
            progress=advance,
        )
    print_skipped(done.skipped, done.findings)
    if output:
        from cdtool.report.plots.coverage_plot import plot_coverage

        plot_coverage(done.map, done.machine, output)
    if as_json:
        print_json(_as_dict(done))
    else:
        _show(done)
        if output:
            typer.echo(f"written: {plain(output)}")
    leave(done.skipped)


def _show(done: Coverage) -> None:
    made = done.map
    rows = []
    for name, cells in made.cells.items():
        for stiffness in made.stiffnesses:
            here = [cell for key, cell in cells.items() if key.stiffness == stiffness]
            latencies = [value for cell in here for value in cell.range_ms if math.isfinite(value)]
            forces = [cell.force_n for cell in here if math.isfinite(cell.force_n)]
            rows.append(
                (
                    name,
                    digits(float(f"{stiffness / 1e3:.3g}")),
                    str(sum(cell.contacts for cell in here)),
                    str(sum(cell.missed for cell in here)),
                    _range(latencies),
                    _range(forces),
                )
            )
    columns = [("detector", "left"), ("stiffness\nN/mm", "right"), ("contacts", "right"), ("missed", "right")]
    columns += [("latency\nms", "right"), ("force at alarm\nN", "right")]
    table(columns, rows)
    places = (
        f"{counted(len(made.positions), 'position')} from {made.positions[0]:g} to {made.positions[-1]:g} {made.unit}"
    )
    means = "least and greatest mean of the positions and brackets"
    typer.echo(f"{plain(done.machine)}: injected contacts at {places}; {means}")
    telling = made.most_telling()
    if telling:
        typer.echo("a test at the rig would tell most here:")
    for name, key, cell in telling:
        missed = f"{cell.missed} of {cell.contacts} missed" if cell.missed else f"+- {cell.uncertainty_ms:.0f} ms"
        spring = digits(float(f"{key.stiffness / 1e3:.3g}"))
        typer.echo(f"  {name} at {key.position:g} {made.unit}, {spring} N/mm: {missed}")


def _range(values: list[float]) -> str:
    if not values:
        return "-"
    low, high = (digits(float(f"{value:.3g}")) for value in (min(values), max(values)))
    return low if low == high else f"{low} to {high}"


def _as_dict(done: Coverage) -> dict[str, Any]:
    return {
        "machine": done.machine,
        "unit": done.map.unit,
        "positions": list(done.map.positions),
        "stiffnesses_n_per_m": list(done.map.stiffnesses),
        "cells": [
            {"detector": name, **asdict(key), **asdict(cell)}
            for name, cells in done.map.cells.items()
            for key, cell in cells.items()
        ],
        "skipped": [asdict(item) for item in done.skipped],
    }
