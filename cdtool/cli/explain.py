"""`cdtool explain`."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cdtool.cli.console import leave, number, plain, print_json, print_skipped, say, table
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

if TYPE_CHECKING:
    from cdtool.evaluation.explanation.explanation import AlarmExplanation, Explanation, MissExplanation
    from cdtool.evaluation.explanation.margin import Moment
    from cdtool.workflows.explaining import Explained

# Events that are printed and drawn; --json has all.
_SHOWN = 20


def explain(
    log: Annotated[Path, typer.Argument(help="Recording to explain.", metavar="LOG")],
    machine: MachineOption,
    signature: SignatureOption = None,
    limit: LimitOption = "",
    detector: DetectorOption = None,
    joints: JointsOption = "",
    operations: OperationsOption = "whole",
    debounce: DebounceOption = None,
    rearm: RearmOption = None,
    hysteresis: HysteresisOption = None,
    latch: LatchOption = None,
    onset_above: OnsetAboveOption = None,
    onset_back_to: OnsetBackToOption = None,
    plot: Annotated[
        Path | None,
        typer.Option("--plot", help="PNG, SVG or PDF to draw the first event into; an existing folder: all events."),
    ] = None,
    force: ForceOption = False,
    as_json: JsonOption = False,
) -> None:
    """Explain why each alarm of a log came and why each contact was missed.

    Example: cdtool explain stiff/01.csv --machine machine.toml --signature gate.feekf.json --plot why.png
    """
    from cdtool.evaluation.truth.onset import OnsetRule
    from cdtool.workflows.explaining import explain as run
    from cdtool.workflows.runs import lost

    drawn = plot if plot is None or plot.is_dir() else figure_name(plot, force=force)
    explained = run(
        log,
        machine,
        signature=signature,
        limit=limits_of(limit),
        detector=detector,
        joints=listed(joints),
        operations=operations,
        activation={"debounce": debounce, "rearm": rearm, "hysteresis": hysteresis, "latch": latch},
        onset=OnsetRule(above=onset_above, back_to=onset_back_to),
    )
    skipped = lost(explained.found.recording)
    print_skipped(skipped)
    if as_json:
        print_json(_as_json(log, explained))
    else:
        _show(explained)
    for path in _draw(explained, drawn, log.stem, force=force):
        if not as_json:
            typer.echo(f"plot written to {plain(path)}")
    leave(skipped)


def _show(explained: Explained) -> None:
    shown = explained.events[:_SHOWN]
    for _, item in shown:
        _show_event(item)
    if len(explained.events) > len(shown):
        typer.echo(f"and {len(explained.events) - len(shown)} events more (--json has all)")
    pairs = zip(explained.found.detections, explained.explanations, strict=True)
    quiet = [detection for detection, events in pairs if not events]
    for detection in quiet[:_SHOWN]:
        why = detection.verdict.reason or "no alarm, and no contact without one"
        say(f"{detection.operation.name}, {detection.detector}: {why}")
    if len(quiet) > _SHOWN:
        typer.echo(f"and {len(quiet) - _SHOWN} operations more without an event")


def _show_event(item: Explanation) -> None:
    """Headline, sentences, and the margin over time."""
    from cdtool.evaluation.explanation.explanation import AlarmExplanation
    from cdtool.evaluation.explanation.words import words

    headline, *sentences = words(item)
    say(f"{item.operation}, {item.detector}: {headline}")
    for sentence in sentences:
        say(sentence, indent="  ")
    # One column stays empty, and so is left out, where there is no onset or no alarm to count from.
    alarm = item.alarm.time if isinstance(item, AlarmExplanation) else None
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
        heads = ("from onset\nms", "to alarm\nms", f"signal\n{item.unit}", "limit\n", "margin\n", "of limit\n%")
        table([*((head, "right") for head in heads), ("", "left")], rows)
    typer.echo()


def _draw(explained: Explained, plot: Path | None, stem: str, *, force: bool) -> list[Path]:
    """One figure of the first event, or one an event in a folder; the files that were written."""
    if plot is None:
        return []
    from cdtool.report.plots.margin_plot import plot_explanation

    events = explained.events[: _SHOWN if plot.is_dir() else 1]
    paths = [plot / f"{i:03d}_{stem}.png" if plot.is_dir() else plot for i in range(1, len(events) + 1)]
    paths = [figure_name(path, force=force) for path in paths]
    for (detection, item), path in zip(events, paths, strict=True):
        plot_explanation(detection, item, path)
    return paths


def _as_json(log: Path, explained: Explained) -> dict[str, Any]:
    from cdtool.evaluation.explanation.explanation import AlarmExplanation

    items = [item for _, item in explained.events]
    return {
        "log": str(log),
        "verdicts": [
            {"operation": item.operation.name, "verdict": item.verdict.outcome, "reason": item.verdict.reason or None}
            for item in explained.found.detections
        ],
        "alarms": [_alarm_as_json(item) for item in items if isinstance(item, AlarmExplanation)],
        "missed": [_miss_as_json(item) for item in items if not isinstance(item, AlarmExplanation)],
    }


def _alarm_as_json(item: AlarmExplanation) -> dict[str, Any]:
    return {
        **_common(item),
        "role": item.role,
        "time_s": item.alarm.time,
        "side": item.alarm.side,
        "statistic": item.alarm.statistic,
        "limit": item.alarm.limit,
        "onset_s": item.contact.start if item.contact else None,
        "left_band_s": item.left,
        "missing_samples_skipped": item.skipped,
    }


def _miss_as_json(item: MissExplanation) -> dict[str, Any]:
    return {
        **_common(item),
        "outcome": item.outcome,
        "reason": item.reason or None,
        "onset_s": item.contact.start,
        "watched_ms": 1e3 * item.watched,
        "not_judged": dict(item.not_judged),
        "joints": [
            {
                "joint": found.joint,
                "nearest": _moment_as_json(found.nearest),
                "longest_outside_samples": found.longest,
                "longest_outside_from_s": found.outside_from,
                "held_share_of_limit": found.held,
                "outside_before_contact_from_s": found.latched_from,
            }
            for found in item.approaches
        ],
    }


def _common(item: Explanation) -> dict[str, Any]:
    from cdtool.evaluation.explanation.words import words

    return {
        "operation": item.operation,
        "detector": item.detector,
        "joint": item.joint,
        "unit": item.unit,
        "debounce_samples": item.debounce,
        "words": words(item),
        "detector_reads": list(item.inputs),
        "moved": [
            {
                "channel": found.channel,
                "joint": found.joint,
                "time_s": found.time,
                "direction": found.direction or None,
                "reason": found.reason or None,
            }
            for found in item.moved
        ],
        "margins": [_moment_as_json(moment) for moment in item.moments],
    }


def _moment_as_json(moment: Moment) -> dict[str, Any]:
    return {
        "time_s": moment.time,
        "statistic": moment.statistic,
        "limit": moment.limit,
        "margin": moment.margin,
        "share_of_limit": moment.share,
        "reason": moment.reason or None,
    }
