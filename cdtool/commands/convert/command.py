"""`cdtool convert`."""

from __future__ import annotations

from typing import Annotated

import typer

from cdtool.base.plain_text import counted
from cdtool.commands.console.console import leave_with, plain, print_json, with_findings
from cdtool.commands.console.late_progress import late_progress
from cdtool.commands.console.options import JsonOption, QuietOption
from cdtool.commands.console.place import Place, location


def convert(
    source: Annotated[
        Place, typer.Argument(parser=location, help="The recording to read, or the folder of its parts.", metavar="IN")
    ],
    output: Annotated[
        Place,
        typer.Argument(
            parser=location,
            help="The file to write: .csv, .mcap, .parquet, .feather, .h5, .mf4 or .tdms.",
            metavar="OUT",
        ),
    ],
    machine: Annotated[
        Place | None,
        typer.Option(
            "--machine",
            "-m",
            parser=location,
            help="Machine file: write its channels in SI units. Default: all columns.",
        ),
    ] = None,
    from_: Annotated[
        str | None,
        typer.Option("--from", help="Only from here: a time as 1.5s, or a distance travelled as 0.2m."),
    ] = None,
    to: Annotated[str | None, typer.Option("--to", help="Only up to here.")] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite existing files.")] = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Convert a log to another file format without rounding; each channel keeps its own clock, unit and provenance.

    Example: cdtool convert sample_logs/gate/stiff/03.csv stiff-03.mcap -m sample_logs/gate/machine.toml
    """
    from cdtool.base.settings import Place as PlaceOfKey
    from cdtool.commands.convert.converting import convert as write
    from cdtool.commands.judging.named_logs import LogPart

    with late_progress("converting", quiet=quiet) as advance:
        section = LogPart(begin=from_, end=to).section(PlaceOfKey("convert"))
        done = write(source, output, machine=machine, section=section, force=force, progress=advance)
    if as_json:
        print_json(with_findings(done))
    else:
        clocks = f"{counted(done.clocks, 'clock')}"
        typer.echo(f"{', '.join(map(plain, done.files))}: {done.columns} columns on {clocks}")
        for path in done.machine_files:
            typer.echo(f"{plain(path)}: machine file for it")
    for finding in done.findings:
        if finding.severity != "note" or finding.kind == "unverified":
            typer.echo(f"{finding.severity}: {plain(finding)}", err=True)
    leave_with(done.findings)
