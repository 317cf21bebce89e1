"""Output of `cdtool signature`: a stored file, and the results of a check."""

from __future__ import annotations

import math
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

from cdtool.base.plain_text import LISTED, counted, ordinal
from cdtool.commands.console.console import number, plain, print_line, say, table

if TYPE_CHECKING:
    from cdtool.commands.signature.coverage import SignatureCoverage
    from cdtool.commands.signature.drift import DriftAudit
    from cdtool.commands.signature.summary import JointSummary, SignatureSummary
    from cdtool.commands.signature.upkeep import Checked, CheckedClass
    from cdtool.formats.signature_file import SignatureFile


def show_file(stored: SignatureFile) -> None:
    """Print a signature file as lines and a table."""
    from cdtool.commands.signature.summary import summarise_signature
    from cdtool.thresholds.fitted_signature import FittedSignature

    gains = ", ".join(f"{name} {value}" for name, value in stored.gains.items()) or "none"
    print_line(f"machine: {plain(stored.machine)}")
    say(f"detector: {stored.detector}, gains: {gains}; unit {stored.unit}")
    settings = "".join(f"; {name} {value}" for name, value in stored.settings.items())
    say(f"threshold: {stored.described}{settings}")
    print_line(f"activation: {_activation(stored)}")
    print_line(f"joints: {plain(', '.join(stored.joints))}")
    print_line(f"runs: {len(stored.runs)}, the last {plain(stored.runs[-1].name)}" if stored.runs else "runs: none")
    for words in _between(stored):
        print_line(f"between learned speeds: {plain(words)}")
    rows = []
    for current, first in zip(stored.current, stored.first, strict=True):
        if not (isinstance(current, FittedSignature) and isinstance(first, FittedSignature)):
            continue
        item = summarise_signature(current, first)
        for joint in item.joints:
            moved = f"{joint.moved:.2f} {_moved_at(item, joint)}" if joint.moved > 0.0 else "not"
            stroke = f"{item.travel[0]:.2f} to {item.travel[1]:.2f}"
            grown = f"{item.runs}" if item.runs == item.first_runs else f"{item.runs} (first {item.first_runs})"
            rows.append(
                (item.motion.described, plain(joint.joint), grown, item.sides, stroke, number(joint.spread, 3), moved)
            )
    if rows:
        columns = [("class", "left"), ("joint", "left"), ("effective\nruns", "right"), ("sides", "left")]
        columns += [("limits from\nto, travel", "right"), (f"spread\n{stored.unit}", "right")]
        table([*columns, ("limits moved since\nfirst learned, spreads", "right")], rows)


def _between(stored: SignatureFile) -> list[str]:
    """Return the motions whose bands are interpolated over speed, in words."""
    from cdtool.recordings.motion.speed_range import in_ranges
    from cdtool.thresholds.fitted_signature import FittedSignature

    motions = [item.motion for item in stored.current if isinstance(item, FittedSignature) and item.speed_range]
    ranges = [numbers for numbers in in_ranges(motions) if len(numbers) > 1]
    ends = [(motions[numbers[0]], motions[numbers[-1]]) for numbers in ranges]
    return [f"{slow.described} to {fast.speed_in_words(fast.nominal_speed)}" for slow, fast in ends]


def _moved_at(item: SignatureSummary, joint: JointSummary) -> str:
    unit = item.motion.unit.removesuffix("/s") if joint.moved_along == "travel" else "s"
    return f"at {joint.moved_at:.2f}{f' {unit}' if unit else ''} of {joint.moved_along}"


def _activation(stored: SignatureFile) -> str:
    item = stored.activation
    debounce = "9 ms" if item.debounce is None else f"{item.debounce} samples"
    armed = "latches" if item.latch else f"re-armed after {item.rearm:g} s inside the limits"
    calm = f" of (1 - {item.hysteresis:g}) times the safety factor" if item.hysteresis else ""
    return f"debounce {debounce}, {armed}{calm}"


def file_as_json(stored: SignatureFile) -> dict[str, Any]:
    """Return a signature file as JSON values."""
    from cdtool.commands.signature.summary import summarise_signature
    from cdtool.thresholds.fitted_signature import FittedSignature

    pairs = zip(stored.current, stored.first, strict=True)
    return {
        "file": stored.source,
        "machine": stored.machine,
        "detector": stored.detector,
        "gains": dict(stored.gains),
        "unit": stored.unit,
        "joints": list(stored.joints),
        "threshold": stored.threshold,
        "settings": asdict(stored.rule),
        "safety_factor": stored.current[0].safety_factor,
        "safety_factor_set": asdict(stored.origin),
        "activation": asdict(stored.activation),
        "runs": [asdict(run) for run in stored.runs],
        "classes": [
            _summary_as_json(summarise_signature(current, first))
            for current, first in pairs
            if isinstance(current, FittedSignature) and isinstance(first, FittedSignature)
        ],
    }


def _summary_as_json(summary: SignatureSummary) -> dict[str, Any]:
    return {**asdict(summary), "motion": summary.motion.to_dict()}


def show_class(item: CheckedClass, *, quiet: bool = False) -> None:
    """Print the result of a check for one class of motion."""
    from cdtool.commands.signature.summary import summarise_signature

    is_kept = item.advice.startswith("keep")
    say(f"{item.signature.motion.described}: {item.advice}", tone="good" if is_kept else "unknown")
    print_line(f"safety factor {item.signature.safety_factor:.4g}")
    if item.coverage:
        _show_coverage(item.coverage)
    if item.drift:
        _show_drift(item.drift, quiet=quiet)
    found = summarise_signature(item.signature, item.first)
    for joint in found.joints:
        if joint.moved > 0.0:
            moved = f"{joint.moved:.2f} spreads, {_moved_at(found, joint)}"
            print_line(f"since first learned: the limit of {plain(joint.joint)} moved by up to {moved}")


def _show_coverage(found: SignatureCoverage) -> None:
    factors = [run.critical_factor for run in found.runs if math.isfinite(run.critical_factor)]
    share = 100.0 * max(factors) / found.safety_factor if factors else 0.0
    nearest = f"; the nearest run reaches {share:.0f} % of its limit" if factors else ""
    runs = f"{counted(len(found.runs), 'run')}, each checked against a signature of the others"
    judged = f"{runs}: {counted(found.alarms, 'alarm')}{nearest}"
    print_line(f"coverage: {judged}")
    say(found.verdict, indent="  ")
    for gap in found.gaps[:LISTED]:
        say(f"no limit for {gap.joint} {gap.described}", indent="  ")
    if len(found.gaps) > LISTED:
        print_line(f"  no limit: and {counted(len(found.gaps) - LISTED, 'more section')} (--json has all)")


def _show_drift(found: DriftAudit, *, quiet: bool) -> None:
    from cdtool.commands.signature.words import verdicts

    for joint in found.joints:
        print_line(f"season of {counted(len(joint.runs), 'run')}, {plain(joint.joint)}:")
        for verdict in verdicts(joint):
            say(verdict, indent="  ")
        if quiet:
            continue
        step = max(1, math.ceil(len(joint.runs) / LISTED))
        rows = [
            (
                plain(run.name),
                number(run.overall, 2),
                number(run.local, 2),
                f"{run.local_at:.2f}",
                f"{100.0 * run.margin_used:.0f}",
                "alarm" if run.alarm else "",
            )
            for run in joint.runs[::-step][::-1]
        ]
        columns = [
            ("run", "left"),
            ("overall\nspreads", "right"),
            ("largest\nlocal", "right"),
            (f"at\n{found.unit}", "right"),
        ]
        table([*columns, ("of limit\n%", "right"), ("", "left")], rows)
        if step > 1:
            print_line(f"every {ordinal(step)} run is shown (--json has all)")
    for name, reason in found.not_assessable:
        print_line(f"  not assessable: {plain(name)}: {plain(reason)}")


def checked_as_json(checked: Checked) -> dict[str, Any]:
    """Return the result of a check as JSON values."""
    return {
        "file": checked.file.source,
        "detector": checked.file.detector,
        "classes": [
            {
                "motion": item.signature.motion.to_dict(),
                "safety_factor": item.signature.safety_factor,
                "coverage": _coverage_as_json(item.coverage) if item.coverage else None,
                "drift": _drift_as_json(item.drift) if item.drift else None,
                "advice": item.advice,
            }
            for item in checked.classes
        ],
        "skipped": [asdict(item) for item in checked.skipped],
        "findings": [asdict(item) for item in checked.findings],
    }


def _coverage_as_json(found: SignatureCoverage) -> dict[str, Any]:
    return {**asdict(found), "alarms": found.alarms, "more_runs": found.more_runs, "verdict": found.verdict}


def _drift_as_json(found: DriftAudit) -> dict[str, Any]:
    from cdtool.commands.signature.words import verdicts

    return {
        "axis": found.axis,
        "joints": [
            {
                "joint": joint.joint,
                "verdicts": list(verdicts(joint)),
                "runs": [asdict(run) for run in joint.runs],
            }
            for joint in found.joints
        ],
        "not_assessable": [{"recording": name, "reason": reason} for name, reason in found.not_assessable],
    }
