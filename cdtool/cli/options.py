"""Options that several commands share, described once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

MachineOption = Annotated[Path, typer.Option("--machine", "-m", help="Machine file (TOML); see docs/machine-file.md.")]
OperationsOption = Annotated[
    str,
    typer.Option(
        "--operations", help="How to cut a log into strokes: whole (one a file), motion, or trigger (a channel)."
    ),
]
JointsOption = Annotated[
    str, typer.Option("--joints", help="Joints to watch, separated by commas. Default: all of the machine file.")
]
DebounceOption = Annotated[
    int | None,
    typer.Option("--debounce", help="Samples in succession outside the band that raise an alarm. Default: 9 ms."),
]
JobsOption = Annotated[int, typer.Option("--jobs", "-j", min=1, help="Logs read and analysed side by side.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")]


def listed(text: str) -> tuple[str, ...]:
    """The names in a comma-separated list."""
    return tuple(part.strip() for part in text.split(",") if part.strip())
