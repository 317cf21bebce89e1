"""Make docs/reproduction.md's tables and figures again: python docs/make_reproduction.py (about half a minute)

Simulates gate and arm with one seed, runs the thesis's detectors over them, writes the tables between the markers of
the page and the figures to docs/images. Nothing is taken from a file but the page's own text.
"""

from __future__ import annotations

import contextlib
import re
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

import cdtool
from cdtool.commands.detect.plot import plot_detected
from cdtool.commands.scoring.benchmark_result import BenchmarkResult
from cdtool.commands.simulate.arm_recordings import simulate_arm
from cdtool.commands.simulate.gate_recordings import simulate_gate
from cdtool.formats.machine_file import read_machine_file
from cdtool.formats.signature_store import write_signature
from cdtool.recordings.recording import Recording
from cdtool.report.plots.figures import drawing, new_figure, save
from cdtool.report.plots.panels import cover_peak
from cdtool.report.plots.trigger_plot import most_informative, trigger_figure
from cdtool.results.summary import Summary
from cdtool.results.traces.decimation import decimate
from cdtool.thresholds.signature import Signature

ROOT = Path(__file__).resolve().parents[1]
PAGE = ROOT / "docs" / "reproduction.md"
IMAGES = ROOT / "docs" / "images"
SEED = 701
COUNTS = {"free": 14, "holdout": 40, "stiff": 30, "soft": 30}
LARGEST = 200_000
TITLES = {
    "pure_inertia": "Pure inertia",
    "friction_ekf": "FEEKF",
    "momentum": "GM",
    "pure_torque": "Pure torque",
    "inertial_momentum": "IGM",
}
# The thesis's tables 5.1, 5.2, 6.1 and 6.2: mean and standard deviation in ms of 30 impacts.
THESIS = {
    "5.1": {"pure_inertia": (21, 3), "friction_ekf": (36, 3), "momentum": (76, 5), "pure_torque": (186, 20)},
    "5.2": {"friction_ekf": (66, 10), "momentum": (98, 6), "pure_torque": (193, 15), "pure_inertia": (386, 14)},
    "6.1, trial 1": {"friction_ekf": (10, 3.2), "inertial_momentum": (13, 2.1), "momentum": (35, 5)},
    "6.1, trial 2": {"friction_ekf": None, "inertial_momentum": (19, 3), "momentum": (67, 10)},
    "6.2, trial 1": {"friction_ekf": (93, 2.6), "inertial_momentum": (96, 1.9), "momentum": (122, 10.5)},
    "6.2, trial 2": {"friction_ekf": None, "inertial_momentum": (412, 5.3), "momentum": (438, 7.2)},
}
# The source of each table: the simulated machine and the group of impacts.
SOURCES = {
    "5.1": ("gate", "stiff"),
    "5.2": ("gate", "soft"),
    "6.1, trial 1": ("arm1", "stiff"),
    "6.1, trial 2": ("arm2", "stiff"),
    "6.2, trial 1": ("arm1", "soft"),
    "6.2, trial 2": ("arm2", "soft"),
}
MACHINES = {"gate": "gate", "arm1": "arm, trial 1", "arm2": "arm, trial 2"}


def simulate(work: Path) -> None:
    """The three folders of recordings, with the detectors that the thesis compares."""
    simulate_gate(work / "gate", COUNTS, SEED)
    simulate_arm(work / "arm1", COUNTS, SEED, 1)
    simulate_arm(work / "arm2", COUNTS, SEED, 2)
    setup = work / "gate" / "benchmark.toml"
    text = re.sub(r"^detectors = .*$", 'detectors = ["pi", "feekf", "gm", "pt"]', setup.read_text(), flags=re.M)
    setup.write_text(text, encoding="utf-8")


def latencies(name: str, rows: Sequence[Summary]) -> str:
    """One of the thesis's tables beside the simulated one."""
    group = SOURCES[name][1]
    lines = [
        "| detector | thesis [ms] | simulated [ms] | median [ms] | missed | not assessable |",
        "|---|---|---|---|---|---|",
    ]
    for detector, printed in THESIS[name].items():
        row = next(row for row in rows if row.group == group and row.detector == detector)
        thesis = "-" if printed is None else f"{printed[0]:g} ± {printed[1]:g}"
        found = f"{row.mean_ms:.0f} ± {row.std_ms:.1f}" if row.detected > 1 else "-"
        middle = f"{row.median_ms:.0f}" if row.detected else "-"
        lines.append(f"| {TITLES[detector]} | {thesis} | {found} | {middle} | {row.missed} | {row.not_assessable} |")
    return "\n".join(lines)


def thesis_rule(work: Path, names: Sequence[str]) -> str:
    """Hold-out runs with a false alarm by the thesis's rule and by cdtool's, in which nothing is hit."""
    lines = [
        "| machine | detector | mean + 1 standard deviation, no debounce | cdtool's default signature |",
        "|---|---|---|---|",
    ]
    for name in names:
        file = work / name / "benchmark.toml"
        text = file.read_text(encoding="utf-8")
        plain = work / name / "thesis.toml"
        settings = '[activation]\ndebounce = 1\n\n[signature]\nrule = "thesis"\n'
        old = re.sub(r"\[impacts\.\w+\]\nlogs = .*\n", "", text)
        kept = re.search(r"\[signature\]\n((?:(?!\[|debounce).*\n)*)", old)
        old = re.sub(r"\[(?:signature|activation)\]\n(?:(?!\[).*\n)*", "", old)
        plain.write_text(old + "\n" + settings + (kept.group(1) if kept else ""), encoding="utf-8")
        alarmed = [_alarmed(cdtool.benchmark(item)) for item in (plain, file)]
        for detector, share in alarmed[0].items():
            lines.append(f"| {MACHINES[name]} | {TITLES[detector]} | {share} | {alarmed[1][detector]} |")
    return "\n".join(lines)


def _alarmed(done: BenchmarkResult) -> dict[str, str]:
    """Return, for each assessable detector, how many of the hold-out runs have an alarm."""
    shares = {}
    for item in done.results.exposure:
        if item.group == "holdout" and item.not_assessable < item.operations:
            alarms = done.results.false_alarms
            runs = {a.recording for a in alarms if a.group == "holdout" and a.detector == item.detector}
            shares[item.detector] = f"{len(runs)} of {item.operations}"
    return shares


def example(work: Path, name: str, detector: str, image: str) -> None:
    """Figures 5.6 and 6.7: one detector's signal, its signature and the trigger on a stiff impact."""
    rule = Signature() if name == "gate" else Signature(sides="one", position_window=22e-3)
    joints = {"gate": {}, "arm1": {"joints": "arm"}, "arm2": {"joints": "forearm"}}[name]
    settings = joints if name == "gate" else {**joints, "activation.debounce": 7}
    with contextlib.chdir(work / name):  # so that the title shows a short name
        free = sorted(Path("free").iterdir())
        learned = cdtool.learn_signature(free, "machine.toml", detector, rule=rule, settings=settings)
        write_signature("signature.json", learned.signature)
        found = cdtool.detect("stiff/03.csv", "machine.toml", signature="signature.json")
        plot_detected(found.detected, IMAGES / image)


def impacts(work: Path) -> None:
    """Figure 5.3: force and deceleration of a stiff and of a soft impact."""
    with drawing():
        figure = new_figure(9.0, 4.2)
        panels = figure.subplots(2, 2, sharex="col", sharey="row")
        for column, kind in enumerate(("stiff", "soft")):
            recording = cdtool.read(work / "gate" / kind / "03.csv", work / "gate" / "machine.toml")
            start = _first_force(recording, 20.0)
            window = recording.between(start - 0.2, start + 0.8)
            for row, channel, text in ((0, "force", "load cell [N]"), (1, "acceleration", "acceleration [m/s²]")):
                time, values = decimate(window[channel].time - start, window[channel].values[:, 0], 1000)
                panels[row, column].plot(1e3 * time, values, color="black", linewidth=0.9)
                if column == 0:
                    panels[row, column].set_ylabel(text)
                if row == 0:
                    cover_peak(panels[row, column], float(values.max()))
            panels[0, column].set_title(f"{kind} impact", loc="left")
            panels[1, column].set_xlabel("time from contact onset [ms]")
        save(figure, IMAGES / "reproduction_5_3.png")


def accelerometer(work: Path) -> None:
    """Figure 6.6: the arm's inertial sensor as it is, and without gravity."""
    file = read_machine_file(work / "arm1" / "machine.toml")
    log = work / "arm1" / "stiff" / "03.csv"
    recording = cdtool.read(log, work / "arm1" / "machine.toml")
    raw = np.genfromtxt(log, delimiter=",", names=True)
    with drawing():
        figure = new_figure(9.0, 3.0)
        axes = figure.subplots()
        clean = recording["acceleration"]
        axes.plot(1e-3 * raw["t"], raw["az_1"], color="0.55", linewidth=0.9, label="as measured")
        axes.plot(
            clean.time,
            clean.values[:, 0] * file.machine.imu_position[0],
            color="black",
            linewidth=0.9,
            label="without gravity: link acceleration times the sensor's distance",
        )
        axes.set_xlabel("time [s]")
        axes.set_ylabel("acceleration across\nthe arm [m/s²]")
        figure.legend(loc="outside lower left", ncols=2)
        save(figure, IMAGES / "reproduction_6_6.png")


def _first_force(recording: Recording, level: float) -> float:
    force = recording["force"]
    return float(force.time[np.flatnonzero(force.values[:, 0] > level)[0]])


def triggers(done: dict[str, BenchmarkResult]) -> None:
    """Figures 5.7, 5.8, 6.9 and 6.10: who raises an alarm when."""
    names = {("gate", "stiff"): "5_7", ("gate", "soft"): "5_8"}
    names |= {
        ("arm1", "stiff"): "6_9a",
        ("arm2", "stiff"): "6_9b",
        ("arm1", "soft"): "6_10a",
        ("arm2", "soft"): "6_10b",
    }
    for (machine, group), number in names.items():
        trace = most_informative([trace for trace in done[machine].traces if trace.group == group])
        save(trigger_figure(trace, done[machine].results), IMAGES / f"reproduction_{number}.png")


def write_page(parts: dict[str, str]) -> None:
    """Put each part between its markers; a marker that is missing is an error."""
    text = PAGE.read_text(encoding="utf-8")
    for name, part in parts.items():
        pattern = re.compile(rf"(<!-- made: {re.escape(name)} -->\n).*?(<!-- end -->)", re.S)
        text, count = pattern.subn(lambda match, part=part: f"{match[1]}\n{part}\n\n{match[2]}", text)
        if count != 1:
            raise SystemExit(f"{PAGE.name} has {count} places for '{name}'")
    PAGE.write_text(text, encoding="utf-8")


def main(say: Callable[[str], None] = print) -> None:
    """Make everything again."""
    with tempfile.TemporaryDirectory() as folder:
        work = Path(folder)
        say("simulating")
        simulate(work)
        done = {name: cdtool.benchmark(work / name / "benchmark.toml") for name in MACHINES}
        rows = {name: item.evaluated.summaries for name, item in done.items()}
        parts = {name: latencies(name, rows[SOURCES[name][0]]) for name in THESIS}
        say("the thesis's rule")
        parts["thesis rule"] = thesis_rule(work, tuple(MACHINES))
        say("drawing")
        triggers(done)
        impacts(work)
        accelerometer(work)
        example(work, "gate", "friction_ekf", "reproduction_5_6.png")
        example(work, "arm1", "friction_ekf", "reproduction_6_7a.png")
        example(work, "arm1", "inertial_momentum", "reproduction_6_7b.png")
    write_page(parts)
    for image in sorted(IMAGES.glob("reproduction_*.png")):
        if image.stat().st_size > LARGEST:
            raise SystemExit(f"{image.name} has {image.stat().st_size} bytes, more than {LARGEST}")


if __name__ == "__main__":
    main()
