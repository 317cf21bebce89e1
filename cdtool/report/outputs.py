"""Where a benchmark's results go: by the suffix of each target, or a folder with all of it."""

from __future__ import annotations

import os
import re
import unicodedata
from collections.abc import Sequence
from pathlib import Path

from cdtool.errors import CdtoolError, UsageError
from cdtool.plain_text import plain
from cdtool.report.contacts_csv import contacts_csv
from cdtool.report.figures import SUFFIXES
from cdtool.report.files import write_text
from cdtool.report.markdown import Image, to_markdown
from cdtool.workflows.benchmark import Benchmark
from cdtool.workflows.detection import Detected
from cdtool.workflows.scoring import Trace

_KNOWN = (".json", ".md", ".csv", *SUFFIXES)
_LONGEST_NAME = 40


def check_outputs(targets: Sequence[Path]) -> None:
    """Raise UsageError where a target cannot be written: unknown suffix, no such folder, no permission."""
    for target in targets:
        if target.is_dir():
            _check_writable(target, target)
            continue
        if target.suffix and target.suffix.lower() not in _KNOWN:
            raise UsageError(f"--output is '{plain(target)}'", f"a folder, or a name that ends in {', '.join(_KNOWN)}")
        if not target.suffix and target.exists():
            raise UsageError(f"--output '{plain(target)}' exists and is no folder", "choose another name")
        if not target.parent.is_dir():
            raise UsageError(f"--output is '{plain(target)}': no folder {plain(target.parent)}", "make it first")
        _check_writable(target, target.parent)


def write_outputs(done: Benchmark, targets: Sequence[Path]) -> list[Path]:
    """Write every target; returns what to show: the files, and of a folder its report.md. Raises CdtoolError."""
    check_outputs(targets)
    return [_write_folder(done, target) if _is_folder(target) else _write_file(done, target) for target in targets]


def slug(name: str, taken: set[str]) -> str:
    """A file name's part for a group or detector: letters, digits, hyphens; unlike any in `taken`, and added to it."""
    letters = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    base = re.sub(r"[^a-z0-9]+", "-", letters.lower())[:_LONGEST_NAME].strip("-") or "unnamed"
    found, number = base, 1
    while found in taken:
        number += 1
        found = f"{base}-{number}"
    taken.add(found)
    return found


def _write_file(done: Benchmark, target: Path) -> Path:
    suffix = target.suffix.lower()
    if suffix == ".json":
        write_text(target, done.results.to_json())
    elif suffix == ".md":
        write_text(target, to_markdown(done.results))
    elif suffix == ".csv":
        write_text(target, contacts_csv(done.results))
    else:
        from cdtool.report.latency_plot import plot_latencies

        plot_latencies(done.results, target)
    return target


def _write_folder(done: Benchmark, folder: Path) -> Path:
    try:
        folder.mkdir(exist_ok=True)
    except OSError as fault:
        raise CdtoolError(f"{plain(folder)} cannot be made: {fault.strerror}", "choose another --output") from fault
    images = [Image("latency.png", "latency of every detector in every group")]
    for name in ("results.json", "contacts.csv", images[0].name):
        _write_file(done, folder / name)
    groups: set[str] = set()
    for trace in done.traces:
        images += _write_trace(trace, folder, slug(trace.group, groups))
    report = folder / "report.md"
    write_text(report, to_markdown(done.results, images))
    return report


def _write_trace(trace: Trace, folder: Path, group: str) -> list[Image]:
    from cdtool.report.detection_plot import plot_detected
    from cdtool.report.trigger_plot import plot_triggers

    recording = trace.operation.recording
    images = [Image(f"triggers_{group}.png", f"{trace.operation.name}: all detectors", trace.group)]
    plot_triggers(trace, folder / images[0].name)
    detectors: set[str] = set()
    for detection, matching in zip(trace.detections, trace.matchings, strict=True):
        name = f"detection_{group}_{slug(detection.detector, detectors)}.png"
        plot_detected(Detected(recording, (detection,), trace.contacts, (matching,)), folder / name)
        images.append(Image(name, f"{trace.operation.name}: {detection.detector}", trace.group))
    return images


def _is_folder(target: Path) -> bool:
    return target.is_dir() or not target.suffix


def _check_writable(target: Path, folder: Path) -> None:
    if not os.access(folder, os.W_OK | os.X_OK):
        raise UsageError(f"--output is '{plain(target)}': {plain(folder)} may not be written to", "choose another")
