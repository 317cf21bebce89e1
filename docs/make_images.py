"""Make the images of the docs: python docs/make_images.py

From sample_logs, and the other real recordings if CDTOOL_DATA (or ../shared/data) contains them; what is skipped is
said. An image above 200 kB is an error.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from cdtool import benchmark
from cdtool.report.plots.folder_figures import write_figures
from cdtool.report.writers.base import Report

ROOT = Path(__file__).resolve().parents[1]
IMAGES = ROOT / "docs" / "images"
EXAMPLES = ROOT / "docs" / "examples"
DATA = Path(os.environ.get("CDTOOL_DATA", ROOT.parent / "shared" / "data"))
LARGEST = 200_000
UR10E = ROOT / "sample_logs" / "ur10e"
UR10E_LIMITS = "33,inf,53,inf,inf,inf"
# What docs/examples/ur10e_collisions.py learns for the momentum observer.
UR10E_MOMENTUM_LIMITS = "31.8,29.2,11.3,3.2,2.6,2.9"


def cdtool(*arguments: object, folder: Path) -> None:
    """Run a command in a folder, so that titles show short names; ends the script where it fails.

    An image that it is to make is removed before: one of an earlier version does not say that cdtool made it.
    """
    for image in arguments:
        if isinstance(image, Path) and image.parent == IMAGES:
            image.unlink(missing_ok=True)
    code = "import sys; sys.argv[0] = 'cdtool'; from cdtool.commands.app import main; main()"
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-c", code, *map(str, arguments)]
    subprocess.run(command, cwd=folder, env=environment, check=True, stdout=subprocess.DEVNULL)


def gate(work: Path) -> None:
    """One detector on a stiff impact, all detectors on a soft one, and the latencies."""
    logs = ROOT / "sample_logs" / "gate"
    free = sorted(path.relative_to(logs) for path in (logs / "free").iterdir())
    signature = work / "gate.json"
    cdtool("learn-signature", *free, "-m", "machine.toml", "-d", "feekf", "-o", signature, folder=logs)
    image = IMAGES / "detect_stiff_feekf.png"
    cdtool("detect", "stiff/03.csv", "-m", "machine.toml", "-s", signature, "--plot", image, folder=logs)
    done = benchmark(logs / "benchmark.toml")
    write_figures(Report(done.evaluated, done.traces), work)
    for name in ("latency.png", "triggers_soft.png"):
        shutil.copyfile(work / name, IMAGES / name)
    torque = work / "gate.pt.json"
    cdtool("learn-signature", *free, "-m", "machine.toml", "-d", "pt", "-o", torque, folder=logs)
    image = IMAGES / "explain_stiff_pt.png"
    cdtool("explain", "stiff/03.csv", "-m", "machine.toml", "-s", torque, "--plot", image, folder=logs)


def budget(work: Path) -> None:
    """Latency against false alarms on 300 + 300 simulated impact-free runs, at one false alarm in 100 operations."""
    counts = ("--set", "free=300", "--set", "holdout=300", "--set", "stiff=30", "--set", "soft=30", "--seed", 5)
    cdtool("simulate", "gate", "-o", "budget", *counts, folder=work)
    done = benchmark(work / "budget" / "benchmark.toml", false_alarm_budget="1/100op", jobs=2)
    write_figures(Report(done.evaluated, done.traces), work)
    for name in ("amoc.png", "survival.png"):
        shutil.copyfile(work / name, IMAGES / name)


def emps(work: Path) -> None:
    """The momentum observer on the recording with force pulses."""
    logs, machine, signature = DATA / "emps", EXAMPLES / "emps.toml", work / "emps.json"
    cut, few = "--set=operations=motion", "--set=signature.force=true"
    learn = ("learn-signature", "DATA_EMPS.mat", "-m", machine, "-d", "gm", cut, few, "-o", signature)
    cdtool(*learn, folder=logs)
    image = IMAGES / "emps_pulses_gm.png"
    cdtool("detect", "DATA_EMPS_PULSES.mat", "-m", machine, "-s", signature, cut, "--plot", image, folder=logs)


def ur10e(_: Path) -> None:
    """Pure torque with a limit on the recording with three contacts."""
    limits = ("-d", "pt", f"--set=threshold.limits={UR10E_LIMITS}", "--set=activation.debounce=2")
    image = IMAGES / "ur10e_link4.png"
    cdtool("detect", "link4.csv.gz", "-m", EXAMPLES / "ur10e.toml", *limits, "--plot", image, folder=UR10E)


def ur10e_momentum(_: Path) -> None:
    """The momentum observer of the arm: all joints of the same recording, the elbow of the pushes; needs pinocchio."""
    momentum = ("-m", "machine.toml", "-d", "gm", "--set=activation.debounce=3")
    moving, pushed = IMAGES / "ur10e_momentum.png", IMAGES / "ur10e_push.png"
    all_joints = f"--set=threshold.limits={UR10E_MOMENTUM_LIMITS}"
    cdtool("detect", "link4.csv.gz", *momentum, all_joints, "--plot", moving, folder=UR10E)
    elbow = ("--set=joints=joint3", f"--set=threshold.limits={UR10E_MOMENTUM_LIMITS.split(',')[2]}")
    cdtool("detect", "ur-static.csv.gz", *momentum, *elbow, "--plot", pushed, folder=UR10E)


def main() -> int:
    """Make all images that can be made; 1 where one is too large."""
    IMAGES.mkdir(exist_ok=True)
    samples = ROOT / "sample_logs" / "gate"
    sources = dict.fromkeys((gate, budget), samples)
    sources |= {emps: DATA / "emps", ur10e: UR10E, ur10e_momentum: UR10E}
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder):
        for make, needed in sources.items():
            if needed.is_dir():
                make(Path(folder))
            else:
                print(f"skipped {make.__name__}: no folder {needed}")
    large = [path for path in sorted(IMAGES.glob("*.png")) if path.stat().st_size > LARGEST]
    for path in large:
        print(f"{path.name}: {path.stat().st_size} bytes, more than {LARGEST}")
    return 1 if large else 0


if __name__ == "__main__":
    sys.exit(main())
