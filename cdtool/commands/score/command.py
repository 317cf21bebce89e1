"""`cdtool score`."""

from __future__ import annotations

from typing import Annotated

import typer

from cdtool.commands.console.console import print_skipped, progress
from cdtool.commands.console.options import (
    ClusterOption,
    ForceOption,
    JobsOption,
    JsonOption,
    OutputOption,
    QuietOption,
    set_option,
)
from cdtool.commands.console.place import Place, location
from cdtool.commands.console.summary_table import finish
from cdtool.commands.console.written_reports import show_results, write_reports


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
        typer.Option(
            "--benchmark",
            "-b",
            parser=location,
            help="Benchmark file: recordings, contacts and rules.",
        ),
    ],
    output: OutputOption = None,
    settings: Annotated[list[str] | None, set_option("triggers.clock=source", "JudgingTable")] = None,
    jobs: JobsOption = 1,
    cluster: ClusterOption = None,
    force: ForceOption = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Score the trigger times of any controller or program by the same rules as `cdtool benchmark`.

    Example: cdtool score triggers.csv --benchmark sample_logs/gate/benchmark.toml -o report.html
    """
    from cdtool.commands.judging.settings_table import given_settings
    from cdtool.commands.score.score_triggers import score as run
    from cdtool.execution.workers import Workers
    from cdtool.report.outputs import check_outputs
    from cdtool.report.writers.base import Report
    from cdtool.results.files.results_file import to_json

    targets = output or []
    check_outputs(targets, force=force)
    with progress("scoring", quiet=quiet) as advance:
        done = run(
            triggers,
            benchmark,
            settings=given_settings(settings or ()),
            workers=Workers(jobs, cluster=cluster, progress=advance),
        )
    results = done.evaluated.results
    report = Report(done.evaluated, done.traces)
    write_reports(report, targets, force=force, quiet=quiet, inputs=done.inputs)
    if as_json:
        print_skipped(results.skipped, results.findings)
        typer.echo(to_json(results), nl=False)
    else:
        show_results(done.evaluated, targets, quiet=quiet)
    finish(done.evaluated)
