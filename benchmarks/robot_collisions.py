"""From a stranger's logs to latencies, as in docs/first-log.md: python benchmarks/robot_collisions.py [--logs 34]

34 simulated collisions of a robot (docs/examples/robot_collisions.py) go through `init`, the edits of the page and
`benchmark`, with limits learned until the onset and with those of each run's own first second. Exit status 1 if the
torque deviation misses a contact or has a false alarm, or if an onset is off by more than the sample that it is in.
"""

from __future__ import annotations

import argparse
import csv
import runpy
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import cdtool

EXAMPLES = Path(__file__).resolve().parents[1] / "docs" / "examples"
THRESHOLDS = {
    "limit, learned until the onset": "",
    "baseline": 'threshold = "baseline"',
    "baseline that widens": 'threshold = { name = "baseline", widen = true }',
}


def main() -> int:
    """Run both and print a line for each detector; 1 if the torque deviation is not perfect."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--logs", type=int, default=34)
    with TemporaryDirectory() as folder:
        return 0 if score_all(Path(folder), parser.parse_args().logs) else 1


def score_all(folder: Path, count: int) -> bool:
    """Return whether the torque deviation detects every contact without a false alarm, and the onsets are right."""
    hits, study = folder / "hits", folder / "study"
    write = runpy.run_path(str(EXAMPLES / "robot_collisions.py"))["write_collisions"]
    edited = runpy.run_path(str(EXAMPLES / "first_log_edits.py"))["edited"]
    logs = write(hits)[:count]
    machine = study / "machine.toml"
    cdtool.init_study(logs, study)
    machine.write_text(edited(machine.read_text(encoding="utf-8")), encoding="utf-8")
    drafted = cdtool.init_study(logs, study, machine=machine, force=True)
    with (hits / "onsets.csv").open(encoding="utf-8") as file:
        onsets = {row["recording"]: float(row["onset_s"]) for row in csv.DictReader(file)}
    perfect = True
    for name, threshold in THRESHOLDS.items():
        text = drafted.text
        if threshold:
            head, _, learning = text.partition("threshold = ")
            text = head + threshold + "\n\n[impacts" + learning.partition("[impacts")[2]
        (study / "tried.toml").write_text(text, encoding="utf-8")
        done = cdtool.benchmark(study / "tried.toml")
        for summary in done.evaluated.summaries:
            mean = summary.mean.value
            print(
                f"{name}: {summary.detector}: {summary.detected} of {summary.contacts} detected, "
                f"{summary.false_alarms} false alarms, mean {mean:.1f} ms"
            )
            if summary.detector == "torque_deviation":
                perfect &= summary.detected == count and not summary.false_alarms
        worst = max(_error(hits, row.recording, row.onset_s, onsets) for row in done.results.contacts)
        print(f"{name}: largest error of an onset: {worst:.2f} of the sample that it is in")
        perfect &= worst <= 1.0
    return perfect


def _error(hits: Path, recording: str, onset: float, onsets: dict[str, float]) -> float:
    """Return the error of an onset as a share of the step between the samples around the true one."""
    name = Path(recording).name
    time = np.loadtxt(hits / name, delimiter=",", usecols=0)
    after = int(np.searchsorted(time, onsets[name]))
    return abs(onset - onsets[name]) / float(time[after] - time[after - 1])


if __name__ == "__main__":
    sys.exit(main())
