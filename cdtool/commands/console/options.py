"""Options that several commands share."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from cdtool.base.errors import UsageError
from cdtool.commands.console import completions
from cdtool.commands.console.place import Place, location

if TYPE_CHECKING:
    from cdtool.recordings.log_section import LogSection

MachineOption = Annotated[
    Place,
    typer.Option(
        "--machine",
        "-m",
        parser=location,
        help="Machine file (TOML); see docs/machine-file.md.",
        autocompletion=completions.files(".toml"),
    ),
]
MachineUnlessBenchmarkOption = Annotated[
    Place | None,
    typer.Option(
        "--machine",
        "-m",
        parser=location,
        help="Machine file (TOML); not with --benchmark.",
        autocompletion=completions.files(".toml"),
    ),
]
OperationsOption = Annotated[
    str,
    typer.Option(
        "--operations",
        help="How to divide a log into operations: whole (one per file), motion, or trigger (a channel). Into runs, as "
        "recordings of their own: column:NAME (of ids), label:NAME, or clock-reset.",
        autocompletion=completions.operations,
    ),
]
JointsOption = Annotated[
    str, typer.Option("--joints", help="Joints to monitor, separated by commas. Default: all in the machine file.")
]
DebounceOption = Annotated[
    int | None,
    typer.Option("--debounce", help="Consecutive samples outside the limits before an alarm. Default: 9 ms."),
]
RearmOption = Annotated[
    float | None, typer.Option("--rearm", help="Seconds inside the limits before the alarm is re-armed. Default: 0.5.")
]
HysteresisOption = Annotated[
    float | None,
    typer.Option("--hysteresis", help="Re-arm only within limits of (1 - this) times the safety factor; 0 to 1."),
]
LatchOption = Annotated[bool | None, typer.Option("--latch/--no-latch", help="Keep an alarm until its operation ends.")]
SignatureOption = Annotated[
    Place | None,
    typer.Option(
        "--signature",
        "-s",
        parser=location,
        help="Signature file from cdtool learn-signature.",
        autocompletion=completions.files(".json"),
    ),
]
LimitOption = Annotated[
    str, typer.Option("--limit", help="Fixed limit of |signal| instead: one value, or one per joint, as 40,inf,40.")
]
WarmUpOption = Annotated[
    float | None,
    typer.Option("--warm-up", help="Limits from the run's own first seconds in motion instead: this many."),
]
DetectorOption = Annotated[
    str | None,
    typer.Option(
        "--detector",
        "-d",
        help="Detector; required with --limit or --warm-up.",
        autocompletion=completions.detectors,
    ),
]
BenchmarkOption = Annotated[
    Place | None,
    typer.Option(
        "--benchmark",
        "-b",
        parser=location,
        help="Benchmark file: machine, threshold, onset, window and all other settings are read from it.",
        autocompletion=completions.files(".toml"),
    ),
]
OnsetAboveOption = Annotated[
    float | None, typer.Option("--onset-above", help="Onset: load-cell force above this [N]. Default: from its noise.")
]
OnsetBackToOption = Annotated[
    float | None,
    typer.Option("--onset-back-to", help="Onset: traced back to this force [N]. Default: half of --onset-above."),
]
OnsetHoldOption = Annotated[
    float | None,
    typer.Option("--onset-hold", help="Onset: time above [s]; one sample if the cell is slower. Default: 0.003."),
]
OnsetSigmasOption = Annotated[
    float | None, typer.Option("--onset-sigmas", help="Onset: multiple of the noise's standard deviation. Default: 8.")
]
OnsetSeparationOption = Annotated[
    float | None, typer.Option("--onset-separation", help="Merge contacts closer than this [s]. Default: 1.")
]
LabelsOption = Annotated[
    Place | None,
    typer.Option(
        "--labels",
        parser=location,
        help="Label file (CSV) with the contacts; replaces the load cell.",
        autocompletion=completions.files(".csv"),
    ),
]
LabelsClockOption = Annotated[
    Literal["recording", "source"] | None,
    typer.Option(
        "--labels-clock", help="Clock of the labels' seconds: the recording's, as cdtool shows it, or the source's."
    ),
]
SynchronisationOption = Annotated[
    float | None, typer.Option("--synchronisation", help="Largest offset of the load cell's clock [s]. Default: 0.")
]
WindowOption = Annotated[
    float | None, typer.Option("--window", help="Time after a contact in which an alarm belongs to it [s]. Default: 1.")
]
MassBeforeCellOption = Annotated[
    float | None, typer.Option("--mass-before-cell", help="Mass between load cell and contact [kg]. Default: 0.")
]
FromOption = Annotated[
    str | None,
    typer.Option("--from", help="Use the log from here: a time on its clock as 1.5s, or a distance travelled as 0.2m."),
]
ToOption = Annotated[str | None, typer.Option("--to", help="Use the log up to here: a time or a distance travelled.")]
OutputOption = Annotated[
    list[Place] | None,
    typer.Option(
        "--output",
        "-o",
        parser=location,
        help="Output, repeatable: .json, .parquet, .html, .md, .xml (JUnit), .csv, .png, .svg, .pdf; or a folder.",
    ),
]
ForceOption = Annotated[bool, typer.Option("--force", help="Also replace files that cdtool did not write.")]
JobsOption = Annotated[int, typer.Option("--jobs", "-j", min=1, help="Number of logs to process in parallel.")]
ClusterOption = Annotated[
    str | None,
    typer.Option("--cluster", help="Let a Dask cluster do the work: tcp://host:8786, or local (with --jobs workers)."),
]
TimeoutOption = Annotated[
    float | None, typer.Option("--timeout", help="Leave out a log that takes longer than this [s]. Default: no limit.")
]
RetriesOption = Annotated[
    int, typer.Option("--retries", min=0, help="How often a log that took too long or ended its worker is tried again.")
]
QuietOption = Annotated[
    bool, typer.Option("--quiet", "-q", help="Print the conclusion and what is wrong; no tables, no progress.")
]
SetOption = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="KEY=VALUE",
        help="A key of the benchmark file in place of its value, repeatable, as activation.debounce=9.",
        autocompletion=completions.settings,
    ),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")]


def keys_option(meaning: str, model: str) -> Any:
    """Return the option --set of the keys of a model, named as module:Class, with what its help says."""
    return typer.Option("--set", metavar="KEY=VALUE", help=meaning, autocompletion=completions.keys(model))


def listed(text: str) -> tuple[str, ...]:
    """Return the names in a comma-separated list."""
    return tuple(part.strip() for part in text.split(",") if part.strip())


def section_of(begin: str | None, end: str | None) -> LogSection:
    """Return the part of a log that --from and --to describe; raises UsageError."""
    from cdtool.recordings.log_section import LogSection, Mark

    marks: list[Mark | None] = []
    for option, text in (("--from", begin), ("--to", end)):
        try:
            marks.append(None if text is None else Mark.parse(text))
        except UsageError as fault:
            raise UsageError(f"{option} {fault.message}", fault.hint) from fault
    return LogSection(*marks)


def limits_of(text: str) -> tuple[float, ...]:
    """Return the numbers of --limit; raises UsageError."""
    try:
        limits = tuple(float(part) for part in text.split(",")) if text else ()
    except ValueError:
        raise UsageError(
            f"--limit is '{text}'", "give numbers separated by commas, inf for a joint that is not monitored"
        ) from None
    if limits and all(limit == math.inf for limit in limits):
        raise UsageError(f"--limit is '{text}': no joint is monitored", "give a number for at least one joint")
    return limits


def figure_name(plot: Path, *, force: bool) -> Path:
    """Return the file of --plot; raises UsageError for a wrong suffix, a missing folder, or a file not from cdtool."""
    from cdtool.base.files.foreign import refuse_foreign_figure
    from cdtool.base.remote.remote_path import check_place, is_remote
    from cdtool.report.plots.figures import SUFFIXES

    if plot.suffix.lower() not in SUFFIXES:
        raise UsageError(f"--plot is '{plot}'", f"the name must end in {', '.join(SUFFIXES)}")
    if is_remote(plot):
        check_place(plot)
    elif not plot.parent.is_dir():
        raise UsageError(f"--plot is '{plot}': no folder {plot.parent}", "create the folder first")
    refuse_foreign_figure(plot, force=force)
    return plot
