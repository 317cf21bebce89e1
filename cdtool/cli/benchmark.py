"""`cdtool benchmark`."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cdtool.cli.console import leave, number, plain, print_skipped, progress, table
from cdtool.cli.options import JobsOption, JsonOption, listed

if TYPE_CHECKING:
    from cdtool.evaluation.results import Results


def benchmark(
    file: Annotated[Path, typer.Argument(help="Benchmark file (TOML); see docs/benchmark-file.md.", metavar="FILE")],
    output: Annotated[
        list[Path] | None, typer.Option("--output", "-o", help="results.json or a folder for the report; repeatable.")
    ] = None,
    detectors: Annotated[
        str, typer.Option("--detectors", help="Others than the file's, as gm,vo,eo; all: every one that is known.")
    ] = "",
    jobs: JobsOption = 1,
    as_json: JsonOption = False,
) -> None:
    """Learn, detect and compare: latency, misses and false alarms of each detector in each group.

    Example: cdtool benchmark sample_logs/gate/benchmark.toml -o results.json -o report/
    """
    from cdtool.report.outputs import check_outputs, write_outputs
    from cdtool.workflows.benchmark import benchmark as run

    targets = output or []
    check_outputs(targets)
    with progress("benchmark") as advance:
        done = run(file, detectors=listed(detectors), jobs=jobs, progress=advance)
    written = write_outputs(done, targets)
    results = done.results
    print_skipped(results.skipped, results.findings)
    if as_json:
        typer.echo(json.dumps(json.loads(results.to_json()), indent=1, ensure_ascii=False))
    else:
        show_table(results)
        for path in written:
            typer.echo(f"written: {plain(path)}")
    leave(results.skipped)


def show_table(results: Results) -> None:
    """The thesis's table 5.1 for each group, with what its figures have to be read beside."""
    from cdtool.evaluation.statistics import summarise

    columns = [("group", "left"), ("detector", "left")]
    columns += [(name, "right") for name in ("mean\nms", "std\nms", "median\nms", "n", "missed", "n.a.")]
    columns += [("false\nalarms", "right"), ("ops", "right")]
    rows = [
        (
            item.group,
            item.detector,
            number(item.mean_ms),
            number(item.std_ms, 2),
            number(item.median_ms),
            item.detected or "-",
            item.missed if item.contacts else "-",
            item.not_assessable if item.contacts else "-",
            item.false_alarms,
            item.operations,
        )
        for item in summarise(results)
    ]
    table(columns, rows)
    provenance = results.provenance
    typer.echo("latency from contact onset to alarm, debounce included; n: contacts detected; n.a.: not assessable;")
    typer.echo(f"ops: operations scored; onset: {provenance.get('onset')}")
    if provenance.get("watched_joints"):
        typer.echo(f"joints watched, of all: {plain(provenance['watched_joints'])}")
