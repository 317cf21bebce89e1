"""The result of a tuning: one line, a DataFrame, and its files."""

from __future__ import annotations

import tomllib

import pytest

import cdtool
from tests.commands.notebook.values import GATE


@pytest.fixture(scope="module")
def tuned():
    settings = {"tune.thresholds": "limit", "window_s": 0.9, "onset.above_n": 21.0}
    return cdtool.tune(GATE / "benchmark.toml", "1/2op", detectors=["momentum"], settings=settings)


def test_it_is_saved_as_the_command_writes_it_and_the_result_can_be_used(tuned, tmp_path):
    written = tuned.save(tmp_path / "tuned")
    names = {path.name for path in written}
    assert {"machine.toml", "benchmark.toml", "tuning.html", "tuning.json", "signature_momentum.json"} <= names
    assert {path.name for path in (tmp_path / "tuned").iterdir()} == names
    benchmark = tomllib.loads((tmp_path / "tuned" / "benchmark.toml").read_text(encoding="utf-8"))
    assert (benchmark["window_s"], benchmark["onset"]["above_n"]) == (0.9, 21.0)  # what it was tuned with
    found = cdtool.detect(
        GATE / "stiff" / "03.csv",
        tmp_path / "tuned" / "machine.toml",
        signature=tmp_path / "tuned" / "signature_momentum.json",
    )
    assert found.outcome == "alarm"
    with pytest.raises(cdtool.CdtoolError, match="the name of a file"):
        tuned.save(tmp_path / "front.png")
