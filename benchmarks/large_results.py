"""Results of 1,000, 20,000 and 100,000 recordings: what the first process holds and takes, and the HTML page of them.

    python benchmarks/large_results.py

Rows are drawn at random (seeded) and gathered as those of a benchmark, so everything after the detection is measured:
gathering, statistics, every report. Each number of recordings runs in a process of its own; its peak is read from
/proc. The page is opened by headless Chromium, by selenium, if there is one. Linux only.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from statistics import median
from time import process_time
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT))

from timing import environment, table  # noqa: E402

from cdtool.commands.scoring.benchmark_file import read_benchmark_file  # noqa: E402
from cdtool.commands.scoring.gathering import results_before, results_of  # noqa: E402
from cdtool.commands.scoring.log_outcome import DetectorOutcome, LogOutcome, OperationOutcome  # noqa: E402
from cdtool.commands.scoring.pieces import Piece, PieceOutcome  # noqa: E402
from cdtool.commands.scoring.scored_logs import ScoredLogs  # noqa: E402
from cdtool.commands.scoring.scoring import LogRows  # noqa: E402
from cdtool.execution.workers import Workers  # noqa: E402
from cdtool.report.outputs import write_outputs  # noqa: E402
from cdtool.report.writers.base import Report  # noqa: E402
from cdtool.results.curves.sweep import MULTIPLES, Swept  # noqa: E402
from cdtool.results.evaluated import evaluate  # noqa: E402
from cdtool.results.results import Results  # noqa: E402
from cdtool.results.traces.trace import Trace  # noqa: E402
from tests.report.html.html_case import trace_of  # noqa: E402
from tests.synthetic.many_results import DETECTORS, RowsOfLog, rows_of_logs  # noqa: E402

# Recordings and detectors.
SIZES = ((1_000, 5), (20_000, 5), (100_000, 2))
REPORTS = ("results.json", "results.parquet", "report.html", "summary.md", "junit.xml", "contacts.csv", "latency.png")
MOST_MORE_MB, MOST_PAGE_MB, MOST_SECONDS = 200.0, 15.0, 2.0
OPENED = 5


@dataclass
class _Drawn:
    """Scores the next log by drawing its rows."""

    rows: Iterator[RowsOfLog]
    names: tuple[str, ...]
    known: dict[str, RowsOfLog] = field(default_factory=dict)

    def __call__(self, piece: Piece) -> PieceOutcome:
        drawn = self.known.get(piece.path.name) or next(self.rows)
        detectors = tuple(DetectorOutcome(name, (self._on_operation(drawn, name),)) for name in self.names)
        rows = LogRows(drawn.recording, drawn.forces, findings=drawn.findings)
        outcome = LogOutcome(rows, detectors)
        wanted = piece.wanted
        if wanted is None or not wanted.is_wanted(piece.group, tuple(outcome.of_operation(0))):
            return PieceOutcome((outcome,))
        self.known[piece.path.name] = drawn
        named = dict(zip(("quick", "slow"), self.names, strict=False))
        trace = trace_of(lambda name: named.get(name, name), piece.group, drawn.recording.recording)
        return PieceOutcome((LogOutcome(rows, detectors, (trace,)),))

    def _on_operation(self, drawn: RowsOfLog, name: str) -> OperationOutcome:
        contacts = tuple(row for row in drawn.contacts if row.detector == name)
        latency = np.array([[np.nan if row.latency_ms is None else 1e-3 * row.latency_ms for row in contacts]])
        return OperationOutcome(
            unit="N",
            seconds=8.0,
            is_not_assessable=False,
            samples=8000,
            by_reason={"start-up": 160},
            contacts=contacts,
            false_alarms=tuple(row for row in drawn.false_alarms if row.detector == name),
            swept=Swept(np.zeros(len(MULTIPLES), dtype=np.int64), MULTIPLES[:, np.newaxis] * latency),
        )


def measured(recordings: int, detectors: int, folder: Path) -> dict[str, list[float]]:
    """Seconds of the processor, peak of memory [MB] and size [MB] of each step with that many recordings."""
    warm, traces = _gathered(60, detectors)
    write_outputs(Report(evaluate(warm), traces), [folder / name for name in REPORTS])
    shutil.rmtree(folder / "results.parquet")
    steps: dict[str, list[float]] = {"before": [0.0, _peak_mb(), 0.0]}

    def step(name: str, work: Callable[[], Any], target: Path | None = None) -> Any:
        begin = process_time()
        made = work()
        steps[name] = [process_time() - begin, _peak_mb(), _megabytes(target) if target else 0.0]
        return made

    results, traces = step("gathering", lambda: _gathered(recordings, detectors))
    report = Report(step("statistics", lambda: evaluate(results)), traces)
    for name in REPORTS:
        target = folder / name
        step(name, lambda target=target: write_outputs(report, [target]), target)
    return steps


def _gathered(recordings: int, detectors: int) -> tuple[Results, tuple[Trace, ...]]:
    setup = read_benchmark_file(ROOT / "sample_logs" / "gate" / "benchmark.toml")
    names = DETECTORS[:detectors]
    groups = (drawn.recording.group for drawn in rows_of_logs(min(recordings, 3), detectors))
    of_three = list(islice(groups, 3))
    logs = [(of_three[i % 3], Path(f"{i:06d}.mcap")) for i in range(recordings)]
    drawn = _Drawn(rows_of_logs(recordings, detectors), names)
    scored = ScoredLogs(setup, drawn, logs, Workers())
    before = results_before(setup, {"tool": "cdtool", "tool_version": "0", "machine": "door"}, names)
    return results_of(setup, before, scored, dict.fromkeys(names, MULTIPLES), {}), scored.traces


def _peak_mb() -> float:
    lines = Path("/proc/self/status").read_text(encoding="utf-8").splitlines()
    return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM")) * 1024 / 1e6


def _megabytes(path: Path) -> float:
    return 1e-6 * sum(file.stat().st_size for file in (path.rglob("*") if path.is_dir() else [path]))


def opened(page: Path) -> tuple[float, list[str]]:
    """Seconds until the page reacts in headless Chromium, the median of several times, and what it reports."""
    from selenium import webdriver
    from selenium.webdriver.chrome.service import Service

    options = webdriver.ChromeOptions()
    for flag in (*("--headless=new", "--no-sandbox", "--disable-gpu"), "--disable-dev-shm-usage"):
        options.add_argument(flag)
    options.add_argument("--window-size=1400,900")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options=options, service=Service(shutil.which("chromedriver")))
    try:
        seconds = []
        for _ in range(OPENED):
            driver.get(page.as_uri())
            # The script draws everything before the page has loaded.
            loaded = "return performance.getEntriesByType('navigation')[0].loadEventEnd"
            seconds.append(1e-3 * float(driver.execute_script(loaded)))
        return median(seconds), [entry["message"] for entry in driver.get_log("browser")]
    finally:
        driver.quit()


def main() -> int:
    print(environment())
    held, peaks, slopes = True, {}, {}
    with tempfile.TemporaryDirectory() as name:
        for recordings, detectors in SIZES:
            folder = Path(name) / str(recordings)
            folder.mkdir()
            command = [sys.executable, __file__, "--one", str(recordings), str(detectors), str(folder)]
            steps = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
            print(f"\n{recordings} recordings, {detectors} detectors")
            rows = [(step, f"{took:.1f}", f"{peak:.0f}", f"{size:.2f}") for step, (took, peak, size) in steps.items()]
            table(("step", "CPU s", "peak MB", "file MB"), rows)
            peaks[recordings] = max(peak for _, peak, _ in steps.values())
            slopes[recordings] = sum(took for took, _, _ in steps.values())
        print()
        more = peaks[SIZES[1][0]] - peaks[SIZES[0][0]]
        held &= _verdict("peak at 20,000 over that at 1,000 [MB]", more, MOST_MORE_MB)
        page = Path(name) / str(SIZES[-1][0]) / "report.html"
        held &= _verdict("page of 100,000 recordings [MB]", _megabytes(page), MOST_PAGE_MB)
        for recordings, took in slopes.items():
            each = 1e3 * took / recordings
            print(f"      {recordings} recordings: {each:.2f} ms of CPU time each in the first process")
        if shutil.which("chromedriver") is None:
            print("skip  how soon the page reacts: no chromedriver")
        else:
            seconds, messages = opened(page)
            held &= _verdict("page of 100,000 recordings reacts after [s]", seconds, MOST_SECONDS)
            held &= _verdict("messages in its console", len(messages), 0)
    print("ok" if held else "FAIL")
    return 0 if held else 1


def _verdict(name: str, figure: float, at_most: float) -> bool:
    held = figure <= at_most
    print(f"{'ok  ' if held else 'FAIL'}  {name}: {figure:.2f} wanted at most {at_most:g}", flush=True)
    return held


if __name__ == "__main__":
    if sys.argv[1:2] == ["--one"]:
        print(json.dumps(measured(int(sys.argv[2]), int(sys.argv[3]), Path(sys.argv[4]))))
    else:
        sys.exit(main())
