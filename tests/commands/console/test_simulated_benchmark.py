"""`cdtool simulate` writes a benchmark.toml that `cdtool benchmark` can run, or states why it does not."""

from __future__ import annotations

import pytest

from tests.command import cdtool, keys


def _simulated(folder, free, holdout, stiff, machine="gate"):
    counts = keys(free=free, holdout=holdout, stiff=stiff, soft=0)
    done = cdtool("simulate", machine, *counts, "--seed", 5, "-o", folder)
    assert done.status == 0, done.err
    return done.out


@pytest.mark.parametrize("counts", [(2, 0, 1), (2, 1, 0), (10, 0, 1), (2, 0, 1, "arm")])
def test_the_written_benchmark_runs(tmp_path, counts):
    assert "benchmark.toml" in _simulated(tmp_path / "gate", *counts).splitlines()[0]
    done = cdtool("benchmark", tmp_path / "gate" / "benchmark.toml", "--detectors", "pt")
    assert done.status == 0, done.err
    forced = "force = true" in (tmp_path / "gate" / "benchmark.toml").read_text(encoding="utf-8")
    assert forced == (counts[0] < 10)


@pytest.mark.parametrize(
    ("counts", "why"),
    [((0, 1, 1), "--set free=10"), ((1, 0, 1), "--set free=10"), ((2, 0, 0), "set holdout, stiff or soft")],
)
def test_an_unusable_benchmark_is_not_written_and_the_reason_is_shown(tmp_path, counts, why):
    shown = _simulated(tmp_path / "gate", *counts).splitlines()
    assert not (tmp_path / "gate" / "benchmark.toml").exists()
    assert len(shown) == 2 and shown[1].startswith("no benchmark.toml: ") and shown[1].endswith(why)
    assert "recordings" in shown[0] or counts == (0, 0, 1)


def test_more_logs_than_a_folder_holds_are_refused_at_once(tmp_path):
    done = cdtool("simulate", "gate", "--set", "free=99999999999999999999", "-o", tmp_path / "logs")
    assert done.status == 2 and "100000" in done.err and not (tmp_path / "logs").exists()
