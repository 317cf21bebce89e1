"""`cdtool benchmark`."""

from __future__ import annotations

from typing import Annotated

import typer

from cdtool.cli import completions
from cdtool.cli.console import plain, print_skipped, progress
from cdtool.cli.options import ForceOption, JobsOption, JsonOption, OutputOption, listed
from cdtool.cli.place import Place, location
from cdtool.cli.summary_table import finish, show_conclusion, show_table
from cdtool.errors import UsageError


def benchmark(
    file: Annotated[
        Place,
        typer.Argument(parser=location, help="Benchmark file (TOML); see docs/benchmark-file.md.", metavar="FILE"),
    ],
    output: OutputOption = None,
    force: ForceOption = False,
    detectors: Annotated[
        str | None,
        typer.Option(
            "--detectors",
            help="Detectors instead of the file's, as gm,vo,eo; all: all that the logs allow.",
            autocompletion=completions.detector_list,
        ),
    ] = None,
    false_alarm_budget: Annotated[
        str | None,
        typer.Option("--false-alarm-budget", help="Set each safety factor for this rate, as 1/1000op or 0.1/h."),
    ] = None,
    jobs: JobsOption = 1,
    as_json: JsonOption = False,
) -> None:
    """Score detectors on recordings: latency, missed contacts and false alarms per detector and group.

    Exits with status 1 if a limit or force profile in the file is violated.

    Example: cdtool benchmark sample_logs/gate/benchmark.toml -o results.json -o report.html
    """
    from cdtool.evaluation.results_file import to_json
    from cdtool.report.outputs import check_outputs, write_outputs
    from cdtool.report.writers.base import Report
    from cdtool.workflows.benchmark.benchmark import benchmark as run

    targets = output or []
    check_outputs(targets, force=force)
    with progress("benchmark") as advance:
        done = run(
            file,
            detectors=_named(detectors),
            false_alarm_budget=false_alarm_budget,
            jobs=jobs,
            progress=advance,
        )
    written = write_outputs(Report(done.evaluated, done.traces), targets, force=force, inputs=done.inputs)
    print_skipped(done.results.skipped, done.results.findings)
    if as_json:
        typer.echo(to_json(done.results), nl=False)
    else:
        show_conclusion(done.evaluated)
        show_table(done.evaluated)
        for path in written:
            typer.echo(f"written: {plain(path)}")
    finish(done.evaluated)


def _named(detectors: str | None) -> tuple[str, ...]:
    names = listed(detectors or "")
    if detectors is not None and not names:
        raise UsageError("--detectors is empty", "give detector names separated by commas, or omit the option")
    return names
