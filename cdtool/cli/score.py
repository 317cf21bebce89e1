"""`cdtool score`."""

from __future__ import annotations

from typing import Annotated, Literal

import typer

from cdtool.cli.console import plain, print_skipped, progress
from cdtool.cli.options import (
    ClusterOption,
    ForceOption,
    JobsOption,
    JsonOption,
    OutputOption,
    RetriesOption,
    TimeoutOption,
)
from cdtool.cli.place import Place, location
from cdtool.cli.summary_table import finish, show_conclusion, show_table


def score(
    triggers: Annotated[
        Place,
        typer.Argument(
            parser=location,
            help="CSV with columns recording, time_s and, for several detectors, detector.",
            metavar="TRIGGERS",
        ),
    ],
    benchmark: Annotated[
        Place,
        typer.Option("--benchmark", "-b", parser=location, help="Benchmark file: recordings, contacts and rules."),
    ],
    output: OutputOption = None,
    force: ForceOption = False,
    clock: Annotated[
        Literal["recording", "source"],
        typer.Option(
            "--clock", help="Clock of the trigger times: the recording's, as cdtool shows it, or the source's."
        ),
    ] = "recording",
    listed_only: Annotated[
        bool, typer.Option("--listed-only", help="Skip recordings without a row instead of counting them as no alarm.")
    ] = False,
    jobs: JobsOption = 1,
    cluster: ClusterOption = None,
    timeout: TimeoutOption = None,
    retries: RetriesOption = 1,
    as_json: JsonOption = False,
) -> None:
    """Score the trigger times of any controller or program by the same rules as `cdtool benchmark`.

    Example: cdtool score triggers.csv --benchmark sample_logs/gate/benchmark.toml -o report.html
    """
    from cdtool.evaluation.results_file import to_json
    from cdtool.report.outputs import check_outputs, write_outputs
    from cdtool.report.writers.base import Report
    from cdtool.workflows.execution.workers import Workers
    from cdtool.workflows.score_triggers import score as run

    workers = Workers(jobs, timeout, retries, cluster)
    targets = output or []
    check_outputs(targets, force=force)
    with progress("scoring") as advance:
        done = run(triggers, benchmark, clock=clock, listed_only=listed_only, workers=workers, progress=advance)
    results = done.evaluated.results
    written = write_outputs(Report(done.evaluated, done.traces), targets, force=force, inputs=done.inputs)
    print_skipped(results.skipped, results.findings)
    if as_json:
        typer.echo(to_json(results), nl=False)
    else:
        show_conclusion(done.evaluated)
        show_table(done.evaluated)
        for path in written:
            typer.echo(f"written: {plain(path)}")
    finish(done.evaluated)
