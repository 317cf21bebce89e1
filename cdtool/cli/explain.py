"""`cdtool explain`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cdtool.cli.console import leave, plain, print_json, print_not_assessable, print_skipped
from cdtool.cli.explain_shown import SHOWN, explained_as_json, show_explained
from cdtool.cli.log_options import LogOptions
from cdtool.cli.option_groups import with_options
from cdtool.cli.options import ForceOption, JsonOption, figure_name

if TYPE_CHECKING:
    from cdtool.workflows.explaining import Explained


@with_options
def explain(
    log: Annotated[Path, typer.Argument(help="Recording to explain.", metavar="LOG")],
    options: LogOptions,
    plot: Annotated[
        Path | None,
        typer.Option("--plot", help="PNG, SVG or PDF file for the first event, or an existing folder for all events."),
    ] = None,
    force: ForceOption = False,
    as_json: JsonOption = False,
) -> None:
    """Explain the cause of each alarm in a log and why each missed contact was missed.

    With --benchmark, all settings and the threshold come from that file; the results match those of `cdtool benchmark`.

    Example: cdtool explain stiff/01.csv --machine machine.toml --signature gate.feekf.json --plot why.png
    """
    from cdtool.workflows.explaining import explain_log
    from cdtool.workflows.runs import lost

    drawn = plot if plot is None or plot.is_dir() else figure_name(plot, force=force)
    settings = options.settings()
    explained = explain_log(log, settings)
    prepared = settings.prepared()
    found = explained.found
    skipped = [*(prepared.skipped if prepared else ()), *found.not_scored]
    findings = [*(prepared.losses if prepared else ()), *lost(found.recording), *found.findings]
    print_skipped(skipped, findings)
    if as_json:
        print_json(explained_as_json(log, explained))
    else:
        show_explained(explained)
    for path in _draw(explained, drawn, log.stem, force=force):
        if not as_json:
            typer.echo(f"plot written to {plain(path)}")
    leave(skipped, findings, print_not_assessable([(str(log), found)]))


def _draw(explained: Explained, plot: Path | None, stem: str, *, force: bool) -> list[Path]:
    """Draw the first event into a file, or each event into a folder; return the files written."""
    if plot is None:
        return []
    from cdtool.report.plots.margin_plot import plot_explanation

    events = explained.events[: SHOWN if plot.is_dir() else 1]
    paths = [plot / f"{i:03d}_{stem}.png" if plot.is_dir() else plot for i in range(1, len(events) + 1)]
    paths = [figure_name(path, force=force) for path in paths]
    for (detection, item), path in zip(events, paths, strict=True):
        plot_explanation(detection, item, path)
    return paths
