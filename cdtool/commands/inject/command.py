"""`cdtool inject`."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

import typer

from cdtool.base.errors import UsageError
from cdtool.base.plain_text import counted
from cdtool.commands.console.console import (
    leave,
    plain,
    print_json,
    print_line,
    print_next,
    print_skipped,
    print_written,
    progress,
)
from cdtool.commands.console.options import (
    ClusterOption,
    ForceOption,
    JobsOption,
    JsonOption,
    QuietOption,
    SetOption,
)
from cdtool.commands.console.place import Place, location

if TYPE_CHECKING:
    from cdtool.commands.inject.injecting import Injected


def inject(
    file: Annotated[
        Place,
        typer.Argument(
            parser=location,
            help="Benchmark file with a section [inject]; see docs/injection.md.",
        ),
    ],
    output: Annotated[
        list[Place] | None,
        typer.Option(
            "--output",
            "-o",
            parser=location,
            help="A folder for the logs; or the map, repeatable: .html, .json. Default: a table.",
        ),
    ] = None,
    force: ForceOption = False,
    settings: SetOption = None,
    jobs: JobsOption = 1,
    cluster: ClusterOption = None,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Put simulated contacts into impact-free logs, and write these logs, or map where the machine notices them.

    Every channel changes as it would, and the onset is exact; the machine file needs a table [model]. The map has
    latency, force and misses over position and stiffness of the obstacle.

    Example: cdtool inject inject.toml -o injected

    Example: cdtool inject coverage.toml -o map.html -o map.png
    """
    from cdtool.commands.inject.coverage.coverage import coverage
    from cdtool.commands.inject.coverage.files import PAGE, check_coverage_files, coverage_summary, write_coverage
    from cdtool.commands.inject.coverage.shown import show_coverage
    from cdtool.commands.inject.injecting import inject as write_logs
    from cdtool.commands.judging.settings_table import given_settings
    from cdtool.execution.workers import Workers

    targets, workers = output or [], Workers(jobs, cluster=cluster)
    given = given_settings(settings or ())
    folders = [target for target in targets if not target.suffix]
    if folders and len(targets) > 1:
        raise UsageError(f"--output is {plain(folders[0])} and others", "give one folder, or the files of a map")
    if folders:
        with progress("injecting", quiet=quiet) as advance:
            made = write_logs(file, folders[0], settings=given, workers=replace(workers, progress=advance))
        if as_json:
            print_json(made)
        else:
            _show_logs(made)
        print_skipped(made.skipped, ())
        leave(made.skipped)
        return
    check_coverage_files(targets, [file], force=force)
    with_traces = any(target.suffix.lower() == PAGE for target in targets)
    with progress("coverage", quiet=quiet) as advance:
        done = coverage(file, settings=given, with_traces=with_traces, workers=replace(workers, progress=advance))
    write_coverage(done, targets)
    if as_json:
        print_skipped(done.skipped, done.findings)
        print_json(coverage_summary(done))
    else:
        show_coverage(done, quiet=quiet)
        print_written(() if quiet else targets)
    leave(done.skipped)


def _show_logs(made: Injected) -> None:
    groups = dict.fromkeys(case.group for case in made.logs.cases)
    print_line(f"{plain(made.folder)}: {counted(len(made.logs.cases), 'injected contact')} in {', '.join(groups)}")
    for doubt in dict.fromkeys(doubt for case in made.logs.cases for doubt in case.doubts):
        many = sum(doubt in case.doubts for case in made.logs.cases)
        print_line(f"note: {doubt.replace('_', ' ')}: {many} of {len(made.logs.cases)}")
    print_line(f"written: {plain(made.folder)}/benchmark.toml, with {counted(made.copied, 'impact-free log')}")
    print_next("cdtool", "benchmark", f"{made.folder}/benchmark.toml", "-o", f"{made.folder}/report")
