"""`cdtool convert`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

import typer

from cdtool.base.errors import UsageError
from cdtool.base.exit_status import Fact
from cdtool.base.plain_text import counted
from cdtool.commands.console.console import leave_with, plain, print_json, print_line, progress, with_findings
from cdtool.commands.console.options import JsonOption
from cdtool.commands.console.place import Place, location

if TYPE_CHECKING:
    from cdtool.commands.convert.converting import Converted
    from cdtool.commands.convert.recovering import Recovered


def convert(
    source: Annotated[
        Place, typer.Argument(parser=location, help="The recording to read, or the folder of its parts.", metavar="IN")
    ],
    output: Annotated[
        Place,
        typer.Argument(
            parser=location,
            help="The file to write: .csv, .mcap or .parquet.",
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
    recover: Annotated[
        Literal["verified", "all"] | None,
        typer.Option(
            "--recover",
            help="Write what is left of a damaged MCAP file: messages with a checksum, or all, the others marked.",
        ),
    ] = None,
    force: Annotated[bool, typer.Option("--force", help="Overwrite existing files.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Convert a log to another file format without rounding; each channel keeps its own clock, unit and provenance.

    Exits with status 3 if anything was lost or left out.

    Example: cdtool convert stiff/03.csv stiff-03.mcap -m machine.toml
    """
    from cdtool.commands.convert.converting import convert as write
    from cdtool.commands.convert.recovering import Recovered
    from cdtool.commands.convert.recovering import recover as write_what_is_left

    if recover and machine:
        raise UsageError("--recover copies messages as they are", "recover first, then convert with -m")
    done: Converted | Recovered
    with progress("recovering" if recover else "converting", pulses=True) as advance:
        if recover:
            done = write_what_is_left(source, output, recover == "all", force=force, progress=advance)
        else:
            done = write(source, output, machine=machine, force=force, progress=advance)
    if as_json:
        print_json(with_findings(done))
    else:
        typer.echo("\n".join(_recovered(done) if isinstance(done, Recovered) else _converted(done)))
    for finding in done.findings:
        if finding.severity != "note" or finding.kind == "unverified":
            print_line(f"{finding.severity}: {plain(finding)}", err=True)
    left_out = done.left_out if isinstance(done, Recovered) else 0
    if left_out:
        print_line(f"left out: {left_out} messages without a checksum (--recover all keeps them)", err=True)
    leave_with(done.findings, [Fact.LEFT_OUT] if left_out else ())


def _converted(done: Converted) -> list[str]:
    files = f"{', '.join(map(plain, done.files))}: {done.columns} columns on {counted(done.clocks, 'clock')}"
    return [files, *(f"{plain(path)}: machine file for it" for path in done.machine_files)]


def _recovered(done: Recovered) -> list[str]:
    lines = [f"{plain(done.output)}: {counted(done.messages, 'message')}"]
    if done.unverified:
        lines.append(f"{done.unverified} of them have no checksum: their chunks have none")
    return lines
