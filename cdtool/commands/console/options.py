"""Options and arguments that several commands share; patterns of URLs name logs, too."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from cdtool.base.errors import UsageError
from cdtool.commands.console import completions
from cdtool.commands.console.place import Place, location

# What makes a URL a pattern of several logs.
_PATTERN = frozenset("*?[")

MachineOption = Annotated[
    Place,
    typer.Option(
        "--machine",
        "-m",
        parser=location,
        help="Machine file; see docs/machine-file.md.",
    ),
]
DetectorsOption = Annotated[
    str | None,
    typer.Option(
        "--detectors",
        "-d",
        help="Detectors instead of the file's, or all.",
        autocompletion=completions.detector_list,
    ),
]
MachineUnlessBenchmarkOption = Annotated[
    Place | None,
    typer.Option(
        "--machine",
        "-m",
        parser=location,
        help="Machine file; not with --benchmark.",
    ),
]
SignatureOption = Annotated[
    Place | None,
    typer.Option(
        "--signature",
        "-s",
        parser=location,
        help="Signature file of learn-signature.",
    ),
]
_DETECTOR = typer.Option(
    "--detectors", "-d", help="Detector to run, as gm; see cdtool list.", autocompletion=completions.detectors
)
DetectorOption = Annotated[str | None, _DETECTOR]
RequiredDetectorOption = Annotated[str, _DETECTOR]
BenchmarkOption = Annotated[
    Place | None,
    typer.Option(
        "--benchmark",
        "-b",
        parser=location,
        help="Benchmark file: it has all settings.",
    ),
]
BudgetOption = Annotated[
    str | None,
    typer.Option("--false-alarm-budget", metavar="RATE", help="Sets safety factors, as 1/1000op."),
]
OutputOption = Annotated[
    list[Place] | None,
    typer.Option(
        "--output",
        "-o",
        parser=location,
        metavar="PATH",
        help="NAME.json, .html, .csv; a folder.",
    ),
]
ForceOption = Annotated[bool, typer.Option("--force", help="Also replace files not written by cdtool.")]
JobsOption = Annotated[
    int,
    typer.Option("--jobs", "-j", metavar="N", min=1, show_default=False, help="Logs worked on at a time; default: 1."),
]
ClusterOption = Annotated[
    str | None,
    typer.Option("--cluster", metavar="URL", help="Dask: tcp://host:8786, or local."),
]
QuietOption = Annotated[bool, typer.Option("--quiet", "-q", help="Only the conclusion and problems.")]
JsonOption = Annotated[bool, typer.Option("--json", help="Print JSON instead of a table.")]


def keys_option(meaning: str, model: str) -> Any:
    """Return the option --set of the keys of a model, named as module:Class, with what its help says."""
    return typer.Option("--set", metavar="KEY=VALUE", help=meaning, autocompletion=completions.keys(model))


def set_option(example: str, table: str) -> Any:
    """Return the option --set for the keys of a table of `judging.settings_table`, with one as an example."""
    meaning = f"As {example}; the last of a key counts; docs/benchmark-file.md."
    return keys_option(meaning, f"cdtool.commands.judging.settings_table:{table}")


SetOption = Annotated[list[str] | None, set_option("activation.debounce=9", "JudgingTable")]


def logs_argument(description: str) -> Any:
    """Return the argument of one or more logs, with its description in the help."""
    return typer.Argument(parser=location, callback=_each_log, help=description, metavar="LOG")


def _each_log(logs: list[Path]) -> list[Path]:
    """Return the logs with each pattern of a URL replaced by what matches, as a shell does for local files.

    A pattern without a match stays, and is reported as a missing file.
    """
    found: list[Path] = []
    for log in logs:
        found += _matching(log) or [log]
    return found


def _matching(log: Path) -> list[Path]:
    if "://" not in str(log) or not _PATTERN.intersection(str(log)):
        return []
    from cdtool.commands.judging.runs import matching_logs

    return matching_logs(Path(), str(log))


def one_detector(text: str) -> str:
    """Return the name of the one detector that --detectors gives; raises UsageError for several."""
    if "," in text:
        raise UsageError(f"--detectors is '{text}'", "give one name: this command runs one detector")
    return text


def listed(text: str) -> tuple[str, ...]:
    """Return the names in a comma-separated list."""
    return tuple(part.strip() for part in text.split(",") if part.strip())


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
