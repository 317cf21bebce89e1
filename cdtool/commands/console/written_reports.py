"""The last step of a command that scores: its reports are written, with progress, and its results shown."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from cdtool.commands.console.console import print_line, print_skipped, print_written, progress
from cdtool.commands.console.summary_table import show_conclusion, show_table

if TYPE_CHECKING:
    from cdtool.report.writers.base import Report
    from cdtool.results.evaluated import Evaluated


def write_reports(
    report: Report, targets: Sequence[Path], *, force: bool, quiet: bool, inputs: Sequence[Path] = ()
) -> None:
    """Write all reports; a bar until the last figure is written. Raises CdtoolError."""
    from cdtool.report.outputs import write_outputs

    with progress("writing reports", pulses=True, quiet=quiet or not targets) as advance:
        write_outputs(report, targets, force=force, inputs=inputs, progress=advance)


def show_results(evaluated: Evaluated, targets: Sequence[Path], *, quiet: bool, more: Sequence[str] = ()) -> None:
    """Print the conclusion and what was left out, and unless `quiet` the tables, `more` lines, and the files."""
    show_conclusion(evaluated)
    print_skipped(evaluated.results.skipped, evaluated.results.findings)
    if quiet:
        return
    typer.echo()
    show_table(evaluated)
    for line in more:
        print_line(line)
    print_written(targets)
