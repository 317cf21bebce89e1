"""`cdtool benchmark`."""

from __future__ import annotations

import shlex
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cdtool.base.errors import UsageError
from cdtool.base.plain_text import counted
from cdtool.commands.console.console import leave, plain, print_json, print_line, print_next, print_skipped, progress
from cdtool.commands.console.options import (
    BudgetOption,
    ClusterOption,
    DetectorsOption,
    ForceOption,
    JobsOption,
    JsonOption,
    OutputOption,
    QuietOption,
    SetOption,
    listed,
)
from cdtool.commands.console.place import Place, location
from cdtool.commands.console.summary_table import finish
from cdtool.commands.console.written_reports import show_results, write_reports

if TYPE_CHECKING:
    from collections.abc import Mapping

    from cdtool.commands.scoring.benchmark_result import StoreReport
    from cdtool.results.evaluated import Evaluated
    from cdtool.results.results import Results


def benchmark(
    file: Annotated[
        Place,
        typer.Argument(
            parser=location,
            help="Benchmark file; see docs/benchmark-file.md.",
            metavar="FILE",
        ),
    ],
    output: OutputOption = None,
    force: ForceOption = False,
    protocol: Annotated[
        Place | None,
        typer.Option(
            "--protocol",
            "-p",
            parser=location,
            help="Protocol file for -o NAME.pdf or .html.",
        ),
    ] = None,
    detectors: DetectorsOption = None,
    false_alarm_budget: BudgetOption = None,
    settings: SetOption = None,
    jobs: JobsOption = 1,
    cluster: ClusterOption = None,
    store: Annotated[
        Place | None,
        typer.Option(
            "--store",
            parser=location,
            help="Folder of outcomes: only changes are computed.",
        ),
    ] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only check the file and its recordings.")] = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Score detectors on recordings: latency, missed contacts and false alarms per detector and group.

    Status 1: a limit or force profile is violated; 4: a protocol is incomplete.

    Example: cdtool benchmark sample_logs/gate/benchmark.toml -o results.json -o report.html
    """
    from cdtool.commands.judging.settings_table import given_settings
    from cdtool.commands.scoring.benchmark import benchmark as run
    from cdtool.commands.scoring.benchmark_file import SECTIONS
    from cdtool.execution.store.store import Store
    from cdtool.execution.workers import Workers
    from cdtool.report.model import SECTIONS as REPORT_SECTIONS
    from cdtool.report.outputs import check_outputs
    from cdtool.report.writers.base import Report
    from cdtool.results.files.results_file import to_json

    given: dict[str, Any] = {
        "detectors": _named(detectors),
        "false_alarm_budget": false_alarm_budget,
        "settings": given_settings(settings or ()),
    }
    if dry_run:
        _show_dry_run(file, {**given, "workers": Workers(jobs, cluster=cluster)}, as_json=as_json)
        return
    documents = SECTIONS.load("protocol")(file, protocol, output or [], force)
    check_outputs(documents.reports, force=force)
    documents.check()
    with progress("benchmark", quiet=quiet) as advance:
        kept = None if store is None else Store(store)
        done = run(file, **given, workers=Workers(jobs, cluster=cluster, progress=advance), store=kept)
    evaluated: Evaluated = done.evaluated
    try:
        command = _command(file, protocol, output or [], detectors, false_alarm_budget, settings or [])
        evaluated = documents.verdict_of(done, shlex.join(command))
        lines = documents.write(done.inputs)
    finally:  # a protocol that cannot be made does not cost the reports
        report = Report(evaluated, done.traces)
        write_reports(report, documents.reports, force=force, quiet=quiet, inputs=done.inputs)
    if as_json:
        print_skipped(done.results.skipped, done.results.findings)
        typer.echo(to_json(evaluated.results), nl=False)
    else:
        injected = REPORT_SECTIONS.load("injected").lines(evaluated)
        show_results(evaluated, documents.reports, quiet=quiet, more=[*injected, *_stored(done.stored)])
        for line in lines:
            print_line(line)
        if not lines and not quiet:
            _show_next(file, evaluated.results, command, is_written=bool(output))
    finish(evaluated)


def _show_next(file: Path, results: Results, command: list[str], *, is_written: bool) -> None:
    """Print how the first missed contact or false alarm is explained, or else how a report or protocol is made."""
    settings = command[command.index("--set") :] if "--set" in command else []
    wrong: list[Any] = [*(item for item in results.contacts if item.outcome == "missed"), *results.false_alarms]
    logs = ((file.parent / item.recording, item.detector) for item in wrong)
    if found := next((pair for pair in logs if pair[0].exists()), None):
        print_next("cdtool", "explain", found[0], "-b", file, "-d", found[1], *settings)
    elif not is_written:
        print_next(*command, "-o", "report/")
    elif results.forces:
        print_next("cdtool", "protocol", "init", file, "-o", "protocol.toml")


def _command(
    file: Path,
    protocol: Path | None,
    output: list[Path],
    detectors: str | None,
    false_alarm_budget: str | None,
    settings: list[str],
) -> list[str]:
    """Return the command with the options that determine a protocol; of the outputs only their names."""
    options = [("-p", protocol), ("--detectors", detectors), ("--false-alarm-budget", false_alarm_budget)]
    given = [(name, value) for name, value in options if value is not None] + [
        ("-o", Path(path.name)) for path in output
    ]
    given += [("--set", text) for text in settings]
    return ["cdtool", "benchmark", str(file), *(str(word) for pair in given for word in pair)]


def _stored(outcomes: StoreReport | None) -> list[str]:
    """Return how many recordings were computed, if outcomes are kept in a store."""
    if outcomes is None:
        return []
    return [f"store: {counted(outcomes.computed, 'recording')} computed, {outcomes.reused} as stored"]


def _show_dry_run(file: Path, given: Mapping[str, Any], *, as_json: bool) -> None:
    """Print which recordings would be computed, and which cannot be used."""
    from cdtool.commands.scoring.dry_run import dry_run

    found = dry_run(file, **given)
    if as_json:
        print_json(asdict(found))
    else:
        for group, logs in found.logs.items():
            print_line(f"{plain(group)}: {counted(len(logs), 'recording')}")
        print_line(f"learned from: {counted(found.learned, 'recording')}; nothing was computed")
        if found.to_inject:
            print_line(f"{counted(found.to_inject, 'contact')} of [inject] would be made first, and computed too")
        print_skipped(found.skipped)
    leave(found.skipped)


def _named(detectors: str | None) -> tuple[str, ...]:
    names = listed(detectors or "")
    if detectors is not None and not names:
        raise UsageError("--detectors is empty", "give detector names separated by commas, or omit the option")
    return names
