"""Logs without reference channels, from simulator to verdict; the full test is in commit def748d0."""

from __future__ import annotations

from dataclasses import replace

import pytest

import cdtool
from cdtool.commands.scoring.benchmark import benchmark
from cdtool.commands.simulate.arm_recordings import simulate_arm
from cdtool.commands.simulate.gate_model import GateParameters
from cdtool.commands.simulate.gate_recordings import simulate_gate
from tests.command import cdtool as command
from tests.command import keys

DETECTORS = ["igm", "gm"]


@pytest.mark.parametrize(("name", "more"), [("gate", ()), ("arm", ("--trial", 2))])
@pytest.mark.parametrize("file_format", ["csv", "mcap"])
def test_the_simulators_can_leave_the_references_out(name, more, file_format, tmp_path):
    for folder, flag in (("with", ()), ("without", keys(reference="false"))):
        counts = (*keys(free=1, holdout=0, stiff=1, soft=0, format=file_format), *flag, "--seed", 4)
        done = command("simulate", name, *more, *counts, "-o", tmp_path / folder)
        assert done.status == 0
    kinds = [
        cdtool.read(tmp_path / folder / "stiff" / f"01.{file_format}", tmp_path / folder / "machine.toml")
        for folder in ("with", "without")
    ]
    extra = {channel for channel in kinds[0].channels if channel.startswith("reference")}
    assert extra and set(kinds[0].channels) - extra == set(kinds[1].channels)
    assert "reference" not in (tmp_path / "without" / "machine.toml").read_text(encoding="utf-8")
    assert not [item for item in kinds[1].findings if "reference" in str(item)]
    for channel, series in kinds[1].channels.items():
        assert (series.values == kinds[0][channel].values).all()


def test_the_arm_without_references_shows_the_latencies_that_it_shows_with_them(tmp_path):
    found = {}
    for folder, references in (("with", True), ("without", False)):
        counts = {"free": 10, "holdout": 0, "stiff": 1, "soft": 1}
        simulate_arm(tmp_path / folder, counts, 3, trial=2, references=references)
        results = benchmark(tmp_path / folder / "benchmark.toml", detectors=DETECTORS).results
        found[folder] = [(row.recording, row.detector, row.outcome, row.latency_ms) for row in results.contacts]
        assert not results.skipped
    assert found["with"] == found["without"]
    assert {outcome for _, _, outcome, _ in found["without"]} == {"detected"}


def test_a_gate_that_is_hit_while_it_accelerates_is_assessable_without_references(tmp_path):
    for place in (0.05, 0.3):
        gate = replace(GateParameters(), obstacle_position=place, obstacle_scatter=0.002)
        simulate_gate(tmp_path / f"{place}", {"free": 10, "stiff": 1}, 8, parameters=gate, references=False)
        results = benchmark(tmp_path / f"{place}" / "benchmark.toml").results
        assert [row.outcome for row in results.contacts] == ["detected"] * 5
