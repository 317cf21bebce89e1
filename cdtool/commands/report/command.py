"""`cdtool report`."""

from __future__ import annotations

from typing import Annotated

import typer

from cdtool.commands.console.console import plain, print_line
from cdtool.commands.console.options import ForceOption, OutputOption, QuietOption
from cdtool.commands.console.place import Place, location
from cdtool.commands.console.summary_table import finish
from cdtool.commands.console.written_reports import show_results, write_reports


def report(
    results: Annotated[
        Place,
        typer.Argument(
            parser=location,
            help="results.json or results.parquet of a benchmark.",
            metavar="RESULTS",
        ),
    ],
    output: OutputOption = None,
    force: ForceOption = False,
    quiet: QuietOption = False,
) -> None:
    """Write the reports of a benchmark again, without its recordings.

    Traces are read from results.traces.json.gz in the same folder; without it, plots over time are left out. Exits with
    the status of the benchmark, which is part of its conclusion.

    Example: cdtool report results.json -o report.html -o summary.md -o junit.xml
    """
    from cdtool.report.outputs import check_outputs
    from cdtool.report.writers.base import Report
    from cdtool.results.files.reading import load_report

    targets = output or []
    check_outputs(targets, force=force)
    evaluated, traces, note = load_report(results)
    if note:
        print_line(f"note: {plain(note)}", err=True)
    write_reports(Report(evaluated, traces), targets, force=force, quiet=quiet)
    show_results(evaluated, targets, quiet=quiet)
    finish(evaluated)
