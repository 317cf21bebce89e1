"""`cdtool detect`."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cdtool.cli.console import leave, plain, print_error, print_json, print_skipped, progress
from cdtool.cli.detect_shown import as_rows, show_detected
from cdtool.cli.options import (
    DebounceOption,
    DetectorOption,
    ForceOption,
    HysteresisOption,
    JointsOption,
    JsonOption,
    LatchOption,
    LimitOption,
    MachineOption,
    OnsetAboveOption,
    OnsetBackToOption,
    OperationsOption,
    RearmOption,
    SignatureOption,
    figure_name,
    limits_of,
    listed,
)
from cdtool.errors import CdtoolError, ExitStatus, OutputError, SignatureError, UsageError
from cdtool.evaluation.results import Skipped

if TYPE_CHECKING:
    from cdtool.workflows.contact_force import ForceSummary
    from cdtool.workflows.detection import Detected


def detect(
    logs: Annotated[list[Path], typer.Argument(help="Recordings to analyse.", metavar="LOG...")],
    machine: MachineOption,
    signature: SignatureOption = None,
    limit: LimitOption = "",
    detector: DetectorOption = None,
    joints: JointsOption = "",
    contact_at: Annotated[
        str, typer.Option("--contact-at", help="Robots: estimate the force at LINK:X,Y,Z, m in the link's frame.")
    ] = "",
    operations: OperationsOption = "whole",
    debounce: DebounceOption = None,
    rearm: RearmOption = None,
    hysteresis: HysteresisOption = None,
    latch: LatchOption = None,
    onset_above: OnsetAboveOption = None,
    onset_back_to: OnsetBackToOption = None,
    plot: Annotated[
        Path | None, typer.Option("--plot", help="PNG, SVG or PDF to draw; a folder where several logs are given.")
    ] = None,
    force: ForceOption = False,
    as_json: JsonOption = False,
) -> None:
    """Run one detector over logs and show its alarms.

    Example: cdtool detect stiff/01.csv --machine machine.toml --signature gate.feekf.json --plot out.png
    """
    from cdtool.evaluation.truth.onset import OnsetRule
    from cdtool.files import made_folder
    from cdtool.machine_file import read_machine_file
    from cdtool.workflows.contact_force import ContactPoint, summarise_force
    from cdtool.workflows.detection import detect as run
    from cdtool.workflows.runs import absent_truth, lost

    machine_file = read_machine_file(machine)
    limits = limits_of(limit)
    contact = ContactPoint.parse(contact_at) if contact_at else None
    plot_names = _plot_names(plot, logs, force=force)
    done: list[tuple[Path, Detected]] = []
    forces: dict[str, ForceSummary] = {}
    skipped: list[Skipped] = []
    folder = made_folder(plot) if plot and not plot.suffix else nullcontext()
    with folder, progress("detecting") as advance:
        for i, log in enumerate(logs, 1):
            try:
                found = run(
                    log,
                    machine_file,
                    signature=signature,
                    detector=detector,
                    limit=limits,
                    joints=listed(joints),
                    operations=operations,
                    activation={"debounce": debounce, "rearm": rearm, "hysteresis": hysteresis, "latch": latch},
                    onset=OnsetRule(above=onset_above, back_to=onset_back_to),
                )
                if contact:
                    made = [summarise_force(item, machine_file.machine, contact) for item in found.detections]
                    forces |= {item.operation: item for item in made}
                done.append((log, found))
                skipped += lost(found.recording)
                if plot_names:
                    from cdtool.report.plots.detection_plot import plot_detected

                    plot_detected(found, plot_names[log])
            except CdtoolError as fault:
                # What is wrong with the call, the signature or the disk is wrong for every log.
                if len(logs) == 1 or isinstance(fault, UsageError | SignatureError | OutputError):
                    raise
                skipped.append(Skipped(str(log), str(fault)))
            if advance:
                advance(i, len(logs))
    if not done:
        for item in skipped:
            print_error(CdtoolError(item.reason))
        raise typer.Exit(ExitStatus.UNUSABLE)
    taught = "the signature was learned from it: no alarm here shows nothing"
    learned = [Skipped(str(log), taught) for log, found in done if found.learned]
    absent = [Skipped(str(log), str(item)) for log, found in done for item in absent_truth(found.recording)]
    print_skipped(skipped, learned, absent)
    if as_json:
        print_json(as_rows(done, forces))
    else:
        show_detected([found for _, found in done], forces)
        for log, _ in done:
            if log in plot_names:
                typer.echo(f"plot written to {plain(plot_names[log])}")
    leave(skipped)


def _plot_names(plot: Path | None, logs: list[Path], *, force: bool) -> dict[Path, Path]:
    if plot is None:
        return {}
    if len(logs) == 1 and not plot.is_dir():
        return {logs[0]: figure_name(plot, force=force)}
    if plot.suffix:
        raise UsageError(f"--plot is one file for {len(logs)} logs", "give a folder")
    names = {log: plot / f"{i:03d}_{log.stem}.png" for i, log in enumerate(logs, 1)}
    if plot.is_dir():
        names = {log: figure_name(path, force=force) for log, path in names.items()}
    return names
