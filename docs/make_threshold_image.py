"""Draw all thresholds on one soft impact of sample_logs/gate: python docs/make_threshold_image.py

The momentum observer's signal, each threshold learned from the 14 impact-free runs with its default settings. An image
above 200 kB is an error.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np

from cdtool.alarms.activation import Activation
from cdtool.alarms.pipeline import Detection, judge_alone, run_detector
from cdtool.commands.judging.runs import read_named
from cdtool.formats.machine_file import read_machine_file
from cdtool.recordings.operations import operations_of
from cdtool.report.model import AXES
from cdtool.report.number_text import number
from cdtool.report.plots.figures import drawing, new_figure, save, unit_label
from cdtool.report.plots.style import BAND, LIMIT_LINE, ONSET_DASHES, look_of
from cdtool.thresholds import THRESHOLDS
from cdtool.thresholds.settings import with_context
from cdtool.thresholds.signature import Signature
from cdtool.truth.onset import OnsetRule, find_contacts

ROOT = Path(__file__).resolve().parents[1]
LOGS = ROOT / "sample_logs" / "gate"
IMAGE = ROOT / "docs" / "images" / "thresholds.png"
IMPACT = LOGS / "soft" / "03.csv"
DETECTOR = "gm"
LARGEST = 200_000
# What a statistic without a unit counts.
NUMBERS = dict.fromkeys(("innovation", "cusum", "glr"), "standard dev.") | {"combined": "share of the limit"}
# What is shown, in s from the onset.
BEFORE, AFTER = 0.15, 0.25


def main() -> int:
    """Draw the figure; 1 where it is too large."""
    machine_file = read_machine_file(LOGS / "machine.toml")
    machine, detector = machine_file.machine, machine_file.detector(DETECTOR)
    free = [operations_of(read_named(path, machine_file), "whole")[0] for path in sorted((LOGS / "free").iterdir())]
    pairs = [(item.recording.without_ground_truth(), run_detector(item, machine, detector)) for item in free]
    recording = read_named(IMPACT, machine_file)
    (impact, *_) = operations_of(recording, "whole")
    onset = find_contacts(recording, OnsetRule(above=20.0, back_to=8.0))[0].start
    signal = run_detector(impact, machine, detector)
    found = {}
    for name in THRESHOLDS.names():
        rule = with_context(THRESHOLDS.load(name)(), machine.default_sides, Signature(sides=machine.default_sides))
        found[name] = judge_alone(impact, detector.name, signal, [rule.fit(pairs)], Activation())
    with drawing():
        rows = -(-len(found) // 2)
        figure = new_figure(8.0, 1.8 * rows)
        panels = figure.subplots(rows, 2, sharex=True).ravel()
        for axes, (name, detection) in zip(panels, found.items(), strict=False):
            draw(axes, name, detection, onset)
        for axes in panels[len(found) :]:
            axes.set_visible(False)
        for axes in panels[len(found) - 2 : len(found)]:
            axes.tick_params(labelbottom=True)
            axes.set_xlabel(AXES["time"])
        save(figure, IMAGE)
    size = IMAGE.stat().st_size
    print(f"{IMAGE.name}: {size} bytes")
    return 1 if size > LARGEST else 0


def draw(axes: Any, name: str, detection: Detection, onset: float) -> None:
    """One threshold: its statistic, its band, onset and alarm."""
    statistic, band = detection.statistic, detection.band
    shown = (statistic.time >= onset - BEFORE) & (statistic.time <= onset + AFTER)
    time = 1e3 * (statistic.time[shown] - onset)
    values = np.where(statistic.valid, statistic.values, np.nan)[shown, 0]
    upper, lower = band.upper[shown, 0], band.lower[shown, 0]
    low = min(0.0, float(np.nanmin(values)))
    top = 2.2 * float(np.nanmax(upper))
    axes.fill_between(time, np.maximum(lower, low), upper, color=BAND, linewidth=0)
    axes.plot(time, upper, **LIMIT_LINE)
    axes.plot(time, values, color=look_of(detection.detector).colour, linewidth=1.3)
    axes.axvline(0.0, color="black", linewidth=0.9, linestyle=ONSET_DASHES)
    after = [alarm.time - onset for alarm in detection.verdict.crossings if alarm.time >= onset]
    words = "no alarm"
    if after:
        axes.axvline(1e3 * after[0], color=look_of(detection.detector).colour, linewidth=2.2)
        words = f"alarm after {number(1e3 * after[0], error=1.0)} ms"
    axes.set_ylim(low - 0.03 * (top - low), top)
    axes.set_xlim(-1e3 * BEFORE, 1e3 * AFTER)
    axes.set_title(f"{name}: {words}", fontsize=9, loc="left")
    axes.set_ylabel(f"[{NUMBERS.get(name, unit_label(statistic.unit))}]")


if __name__ == "__main__":
    sys.exit(main())
