"""`cdtool inject`."""

from __future__ import annotations

from typing import Annotated

import typer

from cdtool.base.plain_text import counted
from cdtool.commands.console import completions
from cdtool.commands.console.console import leave, plain, print_json, print_skipped, progress
from cdtool.commands.console.options import (
    ClusterOption,
    JobsOption,
    JsonOption,
    QuietOption,
    SetOption,
)
from cdtool.commands.console.place import Place, location


def inject(
    file: Annotated[
        Place,
        typer.Argument(
            parser=location,
            help="Benchmark file with a section [inject]; see docs/injection.md.",
            autocompletion=completions.files(".toml"),
        ),
    ],
    output: Annotated[Place, typer.Option("--output", "-o", parser=location, help="Output folder, new or empty.")],
    file_format: Annotated[
        str | None,
        typer.Option(
            "--format",
            help="csv, mcap, parquet, feather, h5, mf4 or tdms; csv has one clock.",
            autocompletion=completions.one_of(("csv", "mcap", "parquet", "feather", "h5", "mf4", "tdms")),
        ),
    ] = None,
    settings: SetOption = None,
    jobs: JobsOption = 1,
    cluster: ClusterOption = None,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Put simulated contacts into impact-free logs: every channel changes as it would, and the onset is exact.

    The machine file needs a table [model], see docs/injection.md.

    Example: cdtool inject benchmark.toml -o injected
    """
    from cdtool.base.errors import UsageError, nearest
    from cdtool.commands.inject.inject_section import FORMATS
    from cdtool.commands.inject.injecting import inject as run
    from cdtool.commands.judging.settings_table import given_settings
    from cdtool.execution.workers import Workers

    if file_format is not None and file_format not in FORMATS:
        raise UsageError(f"--format is '{file_format}'", nearest(file_format, FORMATS))
    with progress("injecting", quiet=quiet) as advance:
        done = run(
            file,
            output,
            file_format=file_format,
            settings=given_settings(settings or ()),
            workers=Workers(jobs, cluster=cluster),
            progress=advance,
        )
    print_skipped(done.skipped, ())
    if as_json:
        print_json(done)
    else:
        groups = dict.fromkeys(case.group for case in done.logs.cases)
        typer.echo(f"{plain(done.folder)}: {counted(len(done.logs.cases), 'injected contact')} in {', '.join(groups)}")
        doubts = dict.fromkeys(doubt for case in done.logs.cases for doubt in case.doubts)
        for doubt in doubts:
            many = sum(doubt in case.doubts for case in done.logs.cases)
            typer.echo(f"note: {doubt.replace('_', ' ')}: {many} of {len(done.logs.cases)}")
        typer.echo(f"written: {plain(done.folder)}/benchmark.toml, with {counted(done.copied, 'impact-free log')}")
    leave(done.skipped)
