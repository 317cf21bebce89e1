"""`cdtool detect`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import nullcontext
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cdtool.base.errors import CdtoolError, OutputError, SignatureError, UsageError
from cdtool.base.exit_status import Fact
from cdtool.base.log_names import log_stem
from cdtool.commands.console.console import (
    leave,
    print_error,
    print_json,
    print_not_assessable,
    print_skipped,
    print_written,
    progress,
)
from cdtool.commands.console.options import (
    BenchmarkOption,
    DetectorOption,
    ForceOption,
    JsonOption,
    MachineUnlessBenchmarkOption,
    QuietOption,
    SignatureOption,
    figure_name,
    logs_argument,
    one_detector,
    set_option,
)
from cdtool.commands.console.place import Place, location
from cdtool.commands.detect.shown import as_rows, show_conclusion, show_detected

if TYPE_CHECKING:
    from cdtool.alarms.pipeline import Detection
    from cdtool.commands.detect.contact_force import ForceSummary
    from cdtool.commands.detecting.detection import Detected
    from cdtool.commands.detecting.prepared import PreparedDetector
    from cdtool.machines.dynamics import Machine
    from cdtool.results.results import RecordingFinding, Skipped


def detect(
    logs: Annotated[list[Place], logs_argument("Recordings to analyse.")],
    machine: MachineUnlessBenchmarkOption = None,
    benchmark: BenchmarkOption = None,
    signature: SignatureOption = None,
    detectors: DetectorOption = None,
    settings: Annotated[list[str] | None, set_option("threshold.name=baseline", "DetectionTable")] = None,
    contact_at: Annotated[
        str, typer.Option("--contact-at", metavar="LINK:X,Y,Z", help="Robots: estimate the force there [m].")
    ] = "",
    plot: Annotated[
        Place | None,
        typer.Option("--plot", parser=location, help="Figure to draw; a folder for several logs."),
    ] = None,
    force: ForceOption = False,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Run one detector over logs and show its alarms.

    With --benchmark the results match those of `cdtool benchmark`.

    Example: cdtool detect stiff/03.csv --machine machine.toml --signature gate.feekf.json --plot out.png
    """
    from cdtool.base.files.writing import made_folder
    from cdtool.commands.detecting.prepared import prepared
    from cdtool.commands.judging.settings_table import given_settings
    from cdtool.results.results import Skipped

    ready = prepared(
        machine,
        benchmark=benchmark,
        signature=signature,
        detector=detectors and one_detector(detectors),
        settings=given_settings(settings or ()),
    )
    run = _DetectedLogs(
        ready,
        _plot_names(plot, logs, runs=ready.has_runs, force=force),
        _force_at(contact_at, ready.machine_file.machine) if contact_at else None,
        skipped=[*ready.skipped],
        findings=[*ready.losses],
        into_folder=plot is not None and (plot.is_dir() or not plot.suffix),
    )
    folder = made_folder(plot) if plot and not plot.suffix else nullcontext()
    with folder, progress("detecting", quiet=quiet) as advance:
        for i, log in enumerate(logs, 1):
            try:
                run.add(log)
            except CdtoolError as fault:
                # An error in the arguments, the signature or the disk affects every log.
                if len(logs) == 1 or isinstance(fault, UsageError | SignatureError | OutputError):
                    raise
                run.skipped.append(Skipped(str(log), str(fault)))
            if advance:
                advance(i, len(logs))
    if not run.done:
        print_skipped((), run.findings)
        for item in run.skipped:
            print_error(CdtoolError(item.reason))
        leave(facts=[Fact.NOTHING_USABLE])
    run.show(as_json=as_json, quiet=quiet)


@dataclass
class _DetectedLogs:
    """Detection in several logs: the steps for each, and the results so far."""

    ready: PreparedDetector
    plot_names: Mapping[Path, Path]
    estimate_force: Callable[[Detection], ForceSummary] | None
    skipped: list[Skipped]
    findings: list[RecordingFinding]
    into_folder: bool = False
    plotted: list[Path] = field(default_factory=list)
    done: list[tuple[Path, Detected]] = field(default_factory=list)
    forces: dict[str, ForceSummary] = field(default_factory=dict)

    def add(self, log: Path) -> None:
        """Run detection on one log, or on each of its runs, and draw the plots; raises CdtoolError."""
        from cdtool.commands.judging.runs import lost

        detected = self.ready.detect(log)
        self.skipped += detected.skipped
        self.findings += detected.findings
        plots = self._plots(log, len(detected.runs))
        is_cut = self.ready.has_runs
        for number, found in enumerate(detected.runs):
            if self.estimate_force:
                self.forces |= {item.operation: item for item in map(self.estimate_force, found.detections)}
            self.done.append((location(found.recording.source) if is_cut else log, found))
            self.skipped += found.not_scored
            self.findings += [*lost(found.recording), *found.findings]
            if plots:
                from cdtool.commands.detect.plot import plot_detected

                plot_detected(found, plots[number])
                self.plotted.append(plots[number])

    def _plots(self, log: Path, runs: int) -> list[Path]:
        """Return the plot of each run of a log; raises UsageError if one file is named for several runs."""
        if not self.plot_names:
            return []
        name = self.plot_names[log]
        if runs == 1:
            return [name]
        if not self.into_folder:
            raise UsageError(f"--plot names one file for {runs} runs", "give a folder, or name one run as LOG#ID")
        return [name.with_name(f"{name.stem}_{number:03d}{name.suffix}") for number in range(1, runs + 1)]

    def show(self, *, as_json: bool, quiet: bool) -> None:
        """Print the results and exit with their status."""
        from cdtool.base.findings import Finding
        from cdtool.commands.judging.runs import absent_truth
        from cdtool.results.results import RecordingFinding

        learned = [
            RecordingFinding.of(str(log), Finding("learned_from_it")) for log, found in self.done if found.learned
        ]
        absent = [
            RecordingFinding.of(str(log), item) for log, found in self.done for item in absent_truth(found.recording)
        ]
        detected = [found for _, found in self.done]
        if as_json:
            print_json(as_rows(self.done, self.forces))
        else:
            show_conclusion(detected)
        print_skipped(self.skipped, [*learned, *self.findings, *absent])
        if not (as_json or quiet):
            show_detected(detected, self.forces)
            print_written(self.plotted)
        leave(self.skipped, self.findings, print_not_assessable((str(log), found) for log, found in self.done))


def _force_at(contact_at: str, machine: Machine) -> Callable[[Detection], ForceSummary]:
    from cdtool.commands.detect.contact_force import ContactPoint, summarise_force

    return partial(summarise_force, machine=machine, contact=ContactPoint.parse(contact_at))


def _plot_names(plot: Path | None, logs: list[Path], *, runs: bool, force: bool) -> dict[Path, Path]:
    """Return the plot of each log; `runs`: a log may have several runs, whose plots are in a folder."""
    if plot is None:
        return {}
    if len(logs) == 1 and not plot.is_dir() and not (runs and not plot.suffix):
        return {logs[0]: figure_name(plot, force=force)}
    if plot.suffix:
        raise UsageError(f"--plot names one file for {len(logs)} logs", "give a folder")
    names = {log: plot / f"{i:03d}_{log_stem(log)}.png" for i, log in enumerate(logs, 1)}
    if plot.is_dir():
        names = {log: figure_name(path, force=force) for log, path in names.items()}
    return names
