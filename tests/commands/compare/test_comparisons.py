"""A planted regression of the simulated gate is found, and equal builds are not reported as different.

A small set; the full one is benchmarks/compare_builds.py of commit def748d0.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from cdtool import benchmark, compare, simulate_gate
from cdtool.alarms.activation import Activation
from cdtool.commands.scoring.benchmark_file import read_benchmark_file
from cdtool.results.results import Results
from tests.synthetic.builds import MISSED, Outcome, build_results

KEYS = [(name, group) for name in ("momentum", "pure_torque") for group in ("stiff", "soft")]


@pytest.fixture(scope="module")
def builds(tmp_path_factory: pytest.TempPathFactory) -> dict[int, Results]:
    """FEEKF and GM on the same 12 stiff and 12 soft impacts with a debounce of 9 and of 14 samples."""
    folder: Path = tmp_path_factory.mktemp("builds") / "gate"
    simulate_gate(folder, {"free": 10, "stiff": 12, "soft": 12}, seed=77)
    setup = read_benchmark_file(folder / "benchmark.toml")
    made = {count: replace(setup, activation=Activation(count)) for count in (9, 14)}
    return {count: benchmark(item, detectors=["feekf", "gm"]).results for count, item in made.items()}


def test_five_more_samples_of_debounce_are_found_as_five_milliseconds(builds):
    found = compare(builds[9], builds[14])
    assert found.verdict == "worse" and len(found.rows) == 4
    for row in found.rows:
        latency = row.question("latency_ms")
        assert latency is not None and row.pairs == 12
        assert (latency.outcome, latency.change.value) == ("worse", pytest.approx(5.0, abs=0.2))
        assert row.words.startswith("slower by 5.0 ms (5.0 to 5.0)")
    assert {(item.key, item.old, item.new) for item in found.changed} == {("debounce_samples", "9", "14")}


@pytest.mark.parametrize("paired", [True, False])
def test_equal_builds_are_called_neither_worse_nor_better_in_at_least_nine_of_ten_comparisons(paired):
    """With a spread of a quarter, 30 contacts rule out a change of a half; a smaller one is inconclusive."""
    rng = np.random.default_rng(78)

    def drawn() -> list[Outcome]:
        """Skewed latencies, one in twenty missed."""
        latencies = 40.0 * rng.lognormal(0.0, 0.25, 30)
        return [float(x) if found else MISSED for x, found in zip(latencies, rng.random(30) > 0.05, strict=True)]

    other = {} if paired else {"bytes_of": "other", "names": "other-"}
    quiet, tried = Counter[str](), 30
    for _ in range(tried):
        false_alarms = [{key: int(rng.poisson(3.0)) for key in KEYS} for _ in range(2)]
        old = build_results({key: drawn() for key in KEYS}, false_alarms=false_alarms[0], force=None)
        new = build_results({key: drawn() for key in KEYS}, false_alarms=false_alarms[1], force=None, **other)
        found = compare(old, new, relevant_change=0.5)
        assert {row.paired for row in found.rows} == {paired}
        quiet[found.verdict] += 1
        if quiet.total() <= 3:
            assert compare(old, new).verdict in (found.verdict, "inconclusive")
    assert quiet["no change shown"] >= 0.9 * tried
