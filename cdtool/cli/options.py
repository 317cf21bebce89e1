"""Options that several commands share, described once."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from cdtool.errors import UsageError

MachineOption = Annotated[Path, typer.Option("--machine", "-m", help="Machine file (TOML); see docs/machine-file.md.")]
MachineUnlessBenchmarkOption = Annotated[
    Path | None, typer.Option("--machine", "-m", help="Machine file (TOML); not with --benchmark.")
]
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
    typer.Option("--debounce", help="Consecutive samples outside the band that raise an alarm. Default: 9 ms."),
]
RearmOption = Annotated[
    float | None, typer.Option("--rearm", help="Seconds inside the band until an alarm is armed again. Default: 0.5.")
]
HysteresisOption = Annotated[
    float | None,
    typer.Option("--hysteresis", help="Armed again only within limits of (1 - this) times the safety factor; 0 to 1."),
]
LatchOption = Annotated[
    bool | None, typer.Option("--latch/--no-latch", help="An alarm stands until its operation ends.")
]
SignatureOption = Annotated[
    Path | None, typer.Option("--signature", "-s", help="Signature file from cdtool learn-signature.")
]
LimitOption = Annotated[
    str, typer.Option("--limit", help="Instead: |signal| below this; one value, or one a joint, as 40,inf,40.")
]
DetectorOption = Annotated[str | None, typer.Option("--detector", "-d", help="Detector; needed with --limit.")]
BenchmarkOption = Annotated[
    Path | None,
    typer.Option(
        "--benchmark",
        "-b",
        help="Benchmark file: machine, threshold, onset, window and every other setting come from there.",
    ),
]
OnsetAboveOption = Annotated[
    float | None, typer.Option("--onset-above", help="Onset: load cell above this [N]. Default: from its noise.")
]
OnsetBackToOption = Annotated[
    float | None, typer.Option("--onset-back-to", help="Onset: followed back to this [N]. Default: half of it.")
]
OnsetHoldOption = Annotated[
    float | None,
    typer.Option("--onset-hold", help="Onset: seconds above; one sample of a cell slower than that. Default: 0.003."),
]
OnsetSigmasOption = Annotated[
    float | None, typer.Option("--onset-sigmas", help="Onset: standard deviations of the noise. Default: 8.")
]
OnsetSeparationOption = Annotated[
    float | None, typer.Option("--onset-separation", help="Contacts closer than this [s] are one. Default: 1.")
]
LabelsOption = Annotated[
    Path | None, typer.Option("--labels", help="Label file (CSV): its contacts instead of the load cell's.")
]
SynchronisationOption = Annotated[
    float | None, typer.Option("--synchronisation", help="How far the load cell's clock may be off [s]. Default: 0.")
]
WindowOption = Annotated[
    float | None, typer.Option("--window", help="An alarm belongs to a contact for this long [s]. Default: 1.")
]
MassBeforeCellOption = Annotated[
    float | None, typer.Option("--mass-before-cell", help="Mass between load cell and contact [kg]. Default: 0.")
]
OutputOption = Annotated[
    list[Path] | None,
    typer.Option(
        "--output",
        "-o",
        help="Where to, repeatable: .json, .html, .md, .xml (JUnit), .csv, .png, .svg, .pdf; or a folder for all.",
    ),
]
ForceOption = Annotated[bool, typer.Option("--force", help="Also replace files that cdtool did not write.")]
JobsOption = Annotated[int, typer.Option("--jobs", "-j", min=1, help="Logs read and analysed side by side.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")]


def listed(text: str) -> tuple[str, ...]:
    """The names in a comma-separated list."""
    return tuple(part.strip() for part in text.split(",") if part.strip())


def limits_of(text: str) -> tuple[float, ...]:
    """The numbers of --limit; raises UsageError."""
    try:
        limits = tuple(float(part) for part in text.split(",")) if text else ()
    except ValueError:
        raise UsageError(f"--limit is '{text}'", "numbers separated by commas, inf for a joint not watched") from None
    if limits and all(limit == math.inf for limit in limits):
        raise UsageError(f"--limit is '{text}': no joint is watched", "a number for at least one joint")
    return limits


def figure_name(plot: Path, *, force: bool) -> Path:
    """The file of --plot; raises UsageError for a name of no figure, a missing folder, a file that is not ours."""
    from cdtool.foreign_files import refuse_foreign_figure
    from cdtool.report.plots.figures import SUFFIXES

    if plot.suffix.lower() not in SUFFIXES:
        raise UsageError(f"--plot is '{plot}'", f"a name that ends in {', '.join(SUFFIXES)}")
    if not plot.parent.is_dir():
        raise UsageError(f"--plot is '{plot}': no folder {plot.parent}", "make it first")
    refuse_foreign_figure(plot, force=force)
    return plot
