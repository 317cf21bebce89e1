"""`cdtool benchmark`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cdtool.cli.console import plain, print_skipped, progress
from cdtool.cli.options import JobsOption, JsonOption, OutputOption, listed
from cdtool.cli.summary_table import finish, show_limits, show_table


def benchmark(
    file: Annotated[Path, typer.Argument(help="Benchmark file (TOML); see docs/benchmark-file.md.", metavar="FILE")],
    output: OutputOption = None,
    detectors: Annotated[
        str, typer.Option("--detectors", help="Others than the file's, as gm,vo,eo; all: every one that is known.")
    ] = "",
    false_alarm_budget: Annotated[
        str,
        typer.Option("--false-alarm-budget", help="Set each safety factor for it: 1/1000op (operations) or 0.1/h."),
    ] = "",
    jobs: JobsOption = 1,
    as_json: JsonOption = False,
) -> None:
    """Learn, detect and compare: latency, misses and false alarms of each detector in each group.

    Ends with 1 where a figure breaks one of the file's [limits].

    Example: cdtool benchmark sample_logs/gate/benchmark.toml -o results.json -o report.html
    """
    from cdtool.evaluation.results_file import to_json
    from cdtool.report.outputs import Report, check_outputs, write_outputs
    from cdtool.workflows.benchmark import benchmark as run

    targets = output or []
    check_outputs(targets)
    with progress("benchmark") as advance:
        done = run(
            file,
            detectors=listed(detectors),
            false_alarm_budget=false_alarm_budget,
            jobs=jobs,
            progress=advance,
        )
    written = write_outputs(Report(done.evaluated, done.traces), targets)
    print_skipped(done.results.skipped, done.results.findings)
    if as_json:
        typer.echo(to_json(done.results), nl=False)
    else:
        show_table(done.evaluated)
        show_limits(done.evaluated)
        for path in written:
            typer.echo(f"written: {plain(path)}")
    finish(done.evaluated)
