"""The values that the functions of the Python API return for the sample gate. No tests."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import cdtool

ROOT = Path(__file__).parents[3]
GATE = ROOT / "sample_logs" / "gate"
MACHINE = GATE / "machine.toml"
LOG = GATE / "stiff" / "03.csv"
FREE = sorted((GATE / "free").iterdir())


def returned_values(folder: Path) -> dict[str, Any]:
    """What each function returns; `folder` is for files."""
    learned = cdtool.learn_signature(FREE, MACHINE, "feekf")
    learned.save(folder / "gate.json")
    result = cdtool.benchmark(GATE / "benchmark.toml", detectors=["momentum", "friction_ekf"])
    return {
        "read": cdtool.read(LOG, MACHINE),
        "read_machine_file": cdtool.read_machine_file(MACHINE),
        "info": cdtool.info(LOG, machine=MACHINE),
        "learn_signature": learned,
        "check_signature": cdtool.check_signature(folder / "gate.json", FREE, MACHINE),
        "detect": cdtool.detect(LOG, MACHINE, signature=learned),
        "detect of many": cdtool.detect([LOG, GATE / "holdout" / "03.csv"], MACHINE, signature=learned),
        "explain": cdtool.explain(LOG, MACHINE, signature=learned),
        "benchmark": result,
        "score": cdtool.score(ROOT / "docs" / "examples" / "triggers.csv", GATE / "benchmark.toml"),
        "compare": cdtool.compare(result.results, result.results),
        "plan": cdtool.plan(missed_at_most="5%"),
        "init": cdtool.init(LOG, folder / "draft.toml"),
        "study_sensors": cdtool.study_sensors(MACHINE),
    }
