"""`cdtool detect`."""

from __future__ import annotations

from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cdtool.cli.console import leave, plain, print_error, print_json, print_not_assessable, print_skipped, progress
from cdtool.cli.detect_shown import as_rows, show_detected
from cdtool.cli.log_options import LogOptions
from cdtool.cli.option_groups import with_options
from cdtool.cli.options import ForceOption, JsonOption, figure_name
from cdtool.errors import CdtoolError, OutputError, SignatureError, UsageError
from cdtool.evaluation.results import Skipped
from cdtool.exit_status import Fact

if TYPE_CHECKING:
    from cdtool.workflows.contact_force import ForceSummary
    from cdtool.workflows.detection import Detected


@with_options
def detect(  # noqa: C901  the whole command, from its options to its exit status
    logs: Annotated[list[Path], typer.Argument(help="Recordings to analyse.", metavar="LOG...")],
    options: LogOptions,
    contact_at: Annotated[
        str, typer.Option("--contact-at", help="Robots: estimate the force at LINK:X,Y,Z, m in the link's frame.")
    ] = "",
    plot: Annotated[
        Path | None, typer.Option("--plot", help="PNG, SVG or PDF to draw; a folder where several logs are given.")
    ] = None,
    force: ForceOption = False,
    as_json: JsonOption = False,
) -> None:
    """Run one detector over logs and show its alarms.

    With --benchmark every setting and the threshold come from that file, and the figures are those of `cdtool
    benchmark`.

    Example: cdtool detect stiff/01.csv --machine machine.toml --signature gate.feekf.json --plot out.png
    """
    from cdtool.files import made_folder
    from cdtool.workflows.contact_force import ContactPoint, summarise_force
    from cdtool.workflows.detection import detect_log
    from cdtool.workflows.runs import absent_truth, lost

    settings = options.settings()
    prepared, machine_file = settings.prepared(), settings.machine_file()
    contact = ContactPoint.parse(contact_at) if contact_at else None
    plot_names = _plot_names(plot, logs, force=force)
    done: list[tuple[Path, Detected]] = []
    forces: dict[str, ForceSummary] = {}
    skipped: list[Skipped] = [*prepared.skipped] if prepared else []
    folder = made_folder(plot) if plot and not plot.suffix else nullcontext()
    with folder, progress("detecting") as advance:
        for i, log in enumerate(logs, 1):
            try:
                found = detect_log(log, settings)
                if contact:
                    made = [summarise_force(item, machine_file.machine, contact) for item in found.detections]
                    forces |= {item.operation: item for item in made}
                done.append((log, found))
                skipped += [*lost(found.recording), *found.not_scored]
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
        leave(facts=[Fact.NOTHING_USABLE])
    taught = "the signature was learned from it: no alarm here shows nothing"
    learned = [Skipped(str(log), taught) for log, found in done if found.learned]
    absent = [Skipped(str(log), str(item)) for log, found in done for item in absent_truth(found.recording)]
    warnings = [item for _, found in done for item in found.warnings]
    print_skipped(skipped, [*learned, *warnings], [*(note for _, found in done for note in found.notes), *absent])
    if as_json:
        print_json(as_rows(done, forces))
    else:
        show_detected([found for _, found in done], forces)
        for log, _ in done:
            if log in plot_names:
                typer.echo(f"plot written to {plain(plot_names[log])}")
    leave(skipped, print_not_assessable((str(log), found) for log, found in done))


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
