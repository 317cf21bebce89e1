"""A latency from injected contacts is a range where the drive or the slew limit is not known."""

from __future__ import annotations

import json
import math
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cdtool
from cdtool.results.agreement import Agreement, agreements
from tests.command import cdtool as command
from tests.project.pages import benchmark_script
from tests.synthetic.plain_gate import PlainGate, drawn_gate

GATE = Path(__file__).parents[3] / "sample_logs" / "gate"
SETUP = """machine = "model.toml"
detectors = ["gm", "pt", "pi"]
[signature]
force = true
[learn]
logs = ["free/*.csv"]
[impacts.real]
logs = ["stiff/*.csv"]
[inject]
logs = ["holdout/03.csv"]
positions = ["0.9m"]
[inject.obstacles.stiff]
stiffness_n_per_mm = 500
compare_with = "real"
[inject.obstacles.foam]
stiffness_n_per_mm = 1
"""
UNKNOWN = (
    ("observed_wind_up = 0.00494058", "observed_wind_up = 0.0046"),
    ("slew_limit = 800", "observed_slope = 600.0 # 800"),
)


@pytest.fixture
def gate(tmp_path: Path) -> Path:
    """The sample gate, whose slew limit and drive beyond its starts are not known."""
    text = (GATE / "model.toml").read_text(encoding="utf-8")
    for old, new in UNKNOWN:
        assert old in text
        text = text.replace(old, new, 1)
    (tmp_path / "model.toml").write_text(text, encoding="utf-8")
    (tmp_path / "benchmark.toml").write_text(SETUP, encoding="utf-8")
    for name in ("stiff", "holdout", "free"):
        shutil.copytree(GATE / name, tmp_path / name)
    return tmp_path


def by_detector(done: Any, obstacle: str) -> dict[str, Agreement]:
    return {item.detector: item for item in agreements(done.evaluated) if item.injected_group == f"injected_{obstacle}"}


def test_the_range_contains_the_real_contacts_and_is_in_every_report(gate: Path) -> None:
    names = ("-o", gate / "r.json", "-o", gate / "r.md", "-o", gate / "r.html")
    done = command("benchmark", gate / "benchmark.toml", *names)
    assert done.status == 0, done.err
    found = by_detector(cdtool.benchmark(gate / "benchmark.toml"), "stiff")
    momentum, torque = found["momentum"], found["pure_torque"]
    assert momentum.is_range
    assert momentum.injected_ms[0] < momentum.real_ms < momentum.injected_ms[1] + 2.0
    assert torque.injected_ms[0] < torque.real_ms < torque.injected_ms[1]
    # Whatever is known of the machine, the parameters of its model have an error.
    for item in found.values():
        assert item.range_ms[0] <= 0.85 * item.injected_ms[0] and item.range_ms[1] >= 1.15 * item.injected_ms[1]
    # Acceleration alone sees the contact before the drive matters.
    assert not found["pure_inertia"].is_range
    line = next(line for line in done.out.splitlines() if line.startswith("momentum: injected_stiff "))
    assert " to " in line and "real (real)" in line
    assert "bracket: drive rigid beyond its observed wind-up" in done.out
    assert done.out.startswith("1 detection missed without a limit; "), "the verdict is the first sentence"
    assert "bracket: parameters of a model from impact-free logs, 15 %" in done.out
    stated = json.loads((gate / "r.json").read_text(encoding="utf-8"))["provenance"]["injected"]
    assert {f"injected_stiff{end}" for end in ("", "_rigid", "_limited", "_rigid_limited")} <= set(stated)
    assert stated["injected_stiff_rigid"]["assumed"] == ["drive rigid beyond its observed wind-up"]
    text = (gate / "r.md").read_text(encoding="utf-8")
    assert text.index("## Results") < text.index("<summary>Injected contacts (")
    assert "drive rigid beyond its observed wind-up" in text
    assert 'id="injected"' in (gate / "r.html").read_text(encoding="utf-8")


SOFT, STIFF = 5e3, 500e3


@pytest.mark.parametrize(
    ("gate", "names"),
    [
        (drawn_gate(0), ("inertial_momentum", "friction_ekf", "momentum", "pure_torque")),
        (PlainGate(stiffness=math.inf), ("momentum", "pure_torque")),
    ],
    ids=["elastic", "rigid, logged at the load"],
)
def test_the_true_mean_is_within_the_stated_range(gate: PlainGate, names: tuple[str, ...]) -> None:
    found = benchmark_script("injection").compare_plain(gate, 0, (SOFT, STIFF), 4, names)
    for name in names:
        for stiffness in (SOFT, STIFF):
            item = found[stiffness][name]
            assert not np.isnan([*item.injected.ravel(), *item.true]).any(), (stiffness, name)
            assert item.is_in_stated_range, (stiffness, name, item)
        # The range of one obstacle does not contain the latency of the other.
        assert np.min(found[SOFT][name].injected) > 1.5 * np.max(found[STIFF][name].true)
