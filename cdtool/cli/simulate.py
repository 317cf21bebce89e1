"""`cdtool simulate`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from cdtool.cli.console import plain, print_json, progress
from cdtool.cli.options import JsonOption
from cdtool.errors import UsageError, nearest

simulate = typer.Typer(help="Write simulated recordings with known contacts.", no_args_is_help=True)

_FORMATS = ("csv", "mcap", "mixed")


@simulate.callback()
def _simulate() -> None:
    """Write simulated recordings with known contacts."""


@simulate.command("gate")
def gate(
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder to write to.")],
    free: Annotated[int, typer.Option("--free", min=0, help="Impact-free runs to learn from.")] = 14,
    holdout: Annotated[int, typer.Option("--holdout", min=0, help="Impact-free runs kept apart.")] = 40,
    stiff: Annotated[int, typer.Option("--stiff", min=0, help="Impacts on the bare load cell.")] = 30,
    soft: Annotated[int, typer.Option("--soft", min=0, help="Impacts with a rubber bumper.")] = 30,
    seed: Annotated[int, typer.Option("--seed", min=0, help="Same seed, same bytes.")] = 1,
    file_format: Annotated[str, typer.Option("--format", help="csv, mcap, or mixed (two of each group MCAP).")] = "csv",
    as_json: JsonOption = False,
) -> None:
    """The heavy sliding gate of the thesis's chapter 5: recordings, machine.toml and benchmark.toml.

    Example: cdtool simulate gate --free 14 --holdout 40 --stiff 30 --soft 30 --seed 1 -o gate
    """
    if file_format not in _FORMATS:
        raise UsageError(f"unknown format '{file_format}'", nearest(file_format, _FORMATS))
    from cdtool.simulation.gate_recordings import write_gate_recordings

    counts = {"free": free, "holdout": holdout, "stiff": stiff, "soft": soft}
    with progress("simulating") as advance:
        written = write_gate_recordings(output, counts, seed, file_format, advance)
    if as_json:
        print_json({"folder": str(output), "recordings": written, "seed": seed})
        return
    typer.echo(f"{written} recordings, machine.toml and benchmark.toml written to {plain(output)}")
