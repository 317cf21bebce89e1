"""`cdtool info`."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from cdtool.base.errors import CdtoolError
from cdtool.base.exit_status import Fact
from cdtool.commands.console.console import (
    leave_with,
    number,
    plain,
    print_error,
    print_json,
    print_line,
    print_next,
    table,
    with_findings,
)
from cdtool.commands.console.options import (
    JsonOption,
    logs_argument,
)
from cdtool.commands.console.place import Place, location

if TYPE_CHECKING:
    from cdtool.commands.judging.information import Info


def info(
    logs: Annotated[list[Place], logs_argument("Recordings: CSV, MCAP, MAT and more.")],
    machine: Annotated[
        Place | None,
        typer.Option(
            "--machine",
            "-m",
            parser=location,
            help="Machine file: map the channels and check them.",
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Show a log's channels, units, rates, duration, gaps, and warnings; with a machine file, also how late they are.

    Example: cdtool info sample_logs/gate/stiff/03.csv --machine sample_logs/gate/machine.toml
    """
    from cdtool.commands.judging.information import common_delays
    from cdtool.commands.judging.information import info as survey

    done: list[Info] = []
    facts: list[Fact] = []
    for log in logs:
        try:
            done.append(survey(log, machine=machine))
        except CdtoolError as fault:
            print_error(fault)
            facts.append(Fact.LEFT_OUT)
    if as_json:
        print_json([with_findings(item) for item in done])
    else:
        for item in done:
            _show(item)
        if common := common_delays(done):
            typer.echo(f"\nAll {len(done)} logs, if their clocks are the same:\n")
            for finding in common:
                print_line(f"{finding.severity}: {plain(str(finding))}")
        if done and machine is None:
            print_next("cdtool", "init", done[0].source)
    leave_with((finding for item in done for finding in item.findings), facts if done else [Fact.NOTHING_USABLE])


def _show(item: Info) -> None:
    from cdtool.report.alike import grouped_findings

    details = ", ".join(f"{plain(key)} {plain(value)}" for key, value in item.details.items())
    print_line(f"{plain(item.source)}: {item.format}{' (' + details + ')' if details else ''}")
    columns = [("channel", "left"), ("unit", "left")]
    columns += [(name, "right") for name in ("samples", "lost", "Hz", "start\ns", "length\ns", "min", "max")]
    rows = [
        (
            channel.name,
            channel.unit,
            channel.samples,
            channel.missing or "-",
            number(channel.rate_hz, 5),
            number(channel.start_s if channel.start_s is None else round(channel.start_s, 9), 7),
            number(channel.duration_s, 6),
            number(channel.minimum, 4),
            number(channel.maximum, 4),
        )
        for channel in item.channels
    ]
    table(columns, rows)
    typer.echo()
    for severity in ("loss", "warning", "note"):
        for name, text in grouped_findings([found for found in item.findings if found.severity == severity]):
            print_line(f"{severity}: {plain(f'{name}: {text}' if name else text)}")
    if not item.findings:
        print_line("no warnings")
