"""`cdtool explain`: the command, and its output on screen and as JSON."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cdtool.base.log_names import log_stem
from cdtool.base.plain_text import LISTED, counted
from cdtool.commands.console.console import (
    leave,
    number,
    print_json,
    print_line,
    print_not_assessable,
    print_skipped,
    print_written,
    progress,
    say,
    table,
)
from cdtool.commands.console.options import (
    BenchmarkOption,
    DetectorOption,
    ForceOption,
    JsonOption,
    MachineUnlessBenchmarkOption,
    SignatureOption,
    figure_name,
    one_detector,
    set_option,
)
from cdtool.commands.console.place import Place, location

if TYPE_CHECKING:
    from cdtool.commands.explain.explaining import ExplainedRun
    from cdtool.results.explanation.explanation import Explanation

# Its reason already names the speeds.
_BLIND = "not_assessable"


def explain(
    log: Annotated[Place, typer.Argument(parser=location, help="Recording to explain.", metavar="LOG")],
    machine: MachineUnlessBenchmarkOption = None,
    benchmark: BenchmarkOption = None,
    signature: SignatureOption = None,
    detectors: DetectorOption = None,
    settings: Annotated[list[str] | None, set_option("threshold.name=baseline", "DetectionTable")] = None,
    plot: Annotated[
        Place | None,
        typer.Option("--plot", parser=location, help="Figure of the first event; a folder for all."),
    ] = None,
    force: ForceOption = False,
    as_json: JsonOption = False,
) -> None:
    """Explain each alarm in a log and why each missed contact was missed.

    With --benchmark the results match those of `cdtool benchmark`.

    Example: cdtool explain stiff/03.csv --machine machine.toml --signature gate.feekf.json --plot why.png
    """
    from cdtool.commands.detecting.prepared import prepared
    from cdtool.commands.explain.explaining import explain_log
    from cdtool.commands.judging.runs import lost
    from cdtool.commands.judging.settings_table import given_settings

    drawn = plot if plot is None or plot.is_dir() else figure_name(plot, force=force)
    with progress("explaining", pulses=True):
        ready = prepared(
            machine,
            benchmark=benchmark,
            signature=signature,
            detector=detectors and one_detector(detectors),
            settings=given_settings(settings or ()),
        )
        explained = explain_log(log, ready)
    runs = [(run.found.recording.source if ready.has_runs else str(log), run) for run in explained.runs]
    skipped = [*ready.skipped, *explained.skipped]
    skipped += [item for run in explained.runs for item in run.found.not_scored]
    findings = [*ready.losses, *explained.findings]
    for run in explained.runs:
        findings += [*lost(run.found.recording), *run.found.findings]
    print_skipped(skipped, findings)
    if as_json:
        values = [_as_json_value(name, run) for name, run in runs]
        print_json(values if ready.has_runs else values[0])
    else:
        for _, run in runs:
            _show_explained(run)
    plots = _draw(explained.runs, drawn, log_stem(log), force=force)
    print_written(() if as_json else plots)
    leave(skipped, findings, print_not_assessable([(name, run.found) for name, run in runs]))


def _draw(runs: Sequence[ExplainedRun], plot: Path | None, stem: str, *, force: bool) -> list[Path]:
    """Draw the first event into a file, or each event into a folder; return the files written."""
    if plot is None:
        return []
    from cdtool.commands.explain.margin_plot import plot_explanation

    events = [event for run in runs for event in run.events][: None if plot.is_dir() else 1]
    paths = [plot / f"{i:03d}_{stem}.png" if plot.is_dir() else plot for i in range(1, len(events) + 1)]
    paths = [figure_name(path, force=force) for path in paths]
    for (detection, item), path in zip(events, paths, strict=True):
        plot_explanation(detection, item, path)
    return paths


def _show_explained(explained: ExplainedRun) -> None:
    """Print every event of a log, and the operations without one."""
    shown = explained.events[:LISTED]
    for _, item in shown:
        _show_event(item)
    if len(explained.events) > len(shown):
        print_line(f"and {counted(len(explained.events) - len(shown), 'more event')} (--json has all)")
    elsewhere = [item for item in explained.found.detections if item.other_speed and item.verdict.outcome != _BLIND]
    for detection in elsewhere[:LISTED]:
        say(f"{detection.operation.name}, not assessable at another speed: {detection.other_speed}")
    pairs = zip(explained.found.detections, explained.explanations, strict=True)
    quiet = [detection for detection, events in pairs if not events]
    for detection in quiet[:LISTED]:
        why = detection.verdict.reason or "no alarm and no missed contact"
        say(f"{detection.operation.name}, {detection.detector}: {why}")
    if len(quiet) > LISTED:
        print_line(f"and {counted(len(quiet) - LISTED, 'more operation')} without an event")


def _show_event(item: Explanation) -> None:
    """Print the headline, the sentences, and the margin over time."""
    from cdtool.report.explanation_words import words

    headline, *sentences = words(item)
    say(f"{item.operation}, {item.detector}: {headline}")
    for sentence in sentences:
        say(sentence, indent="  ")
    # Without an onset or an alarm to count from, one column stays empty and is dropped.
    alarm = item.alarm.time if item.alarm else None
    rows = [
        (
            f"{1e3 * (moment.time - item.contact.start):.0f}" if item.contact else "",
            f"{1e3 * (moment.time - alarm):.0f}" if alarm is not None else "",
            number(moment.statistic, 4),
            number(moment.limit, 4),
            number(moment.margin, 4),
            f"{100.0 * moment.share:.0f}" if math.isfinite(moment.share) else "-",
            moment.reason,
        )
        for moment in item.moments
    ]
    if rows:
        heads = ("from onset\nms", "to alarm\nms", f"signal\n{item.unit}", "limit\n", "margin\n", "of band\n%")
        table([*((head, "right") for head in heads), ("", "left")], rows)
    typer.echo()


def _as_json_value(log: str, explained: ExplainedRun) -> dict[str, Any]:
    """Return the same as JSON values: an event by the names that it has in Python."""
    from cdtool.commands.console.contact_rows import contact_as_json
    from cdtool.report.explanation_words import words

    items = [{**asdict(item), "words": words(item)} for _, item in explained.events]
    return {
        "log": log,
        "verdicts": [
            {"operation": item.operation.name, "verdict": item.verdict.outcome, "reason": item.verdict.reason or None}
            for item in explained.found.detections
        ],
        "contacts": [
            contact_as_json(detection, row)
            for detection, rows in zip(explained.found.detections, explained.found.contact_rows, strict=True)
            for row in rows
        ],
        "alarms": [item for item in items if item["alarm"]],
        "missed": [item for item in items if not item["alarm"]],
    }
