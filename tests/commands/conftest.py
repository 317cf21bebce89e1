"""A folder of simulated gate recordings, written once by the command itself."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.command import cdtool, keys


@pytest.fixture(scope="session")
def gate_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("gate") / "logs"
    counts = keys(free=11, holdout=2, stiff=2, soft=2)
    done = cdtool("simulate", "gate", *counts, "--seed", 5, "-o", folder)
    assert done.status == 0, done.err
    return folder


@pytest.fixture(scope="session")
def feekf_signature(gate_folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("signature") / "gate.feekf.json"
    logs = sorted((gate_folder / "free").glob("*.csv"))
    done = cdtool(
        "learn-signature", *logs, "--machine", gate_folder / "machine.toml", "--detectors", "feekf", "-o", path
    )
    assert done.status == 0, done.err
    return path
