"""The values that the functions of the Python API return, with everything in them. No tests."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import cdtool
from tests.synthetic import gate_runs

ROOT = Path(__file__).parents[2]
GATE = ROOT / "sample_logs" / "gate"
MACHINE = GATE / "machine.toml"


def returned_values(folder: Path) -> dict[str, Any]:
    """What each function returns for the logs of the sample gate."""
    log, free = GATE / "stiff" / "03.csv", sorted((GATE / "free").iterdir())
    learned = cdtool.learn_signature(free, MACHINE, "feekf")
    learned.save(folder / "gate.json")
    result = cdtool.benchmark(GATE / "benchmark.toml", detectors=["momentum", "friction_ekf"])
    made = {
        "read": cdtool.read(log, MACHINE),
        "read_machine_file": cdtool.read_machine_file(MACHINE),
        "info": cdtool.info(log, machine=MACHINE),
        "learn_signature": learned,
        "check_signature": cdtool.check_signature(folder / "gate.json", free, MACHINE),
        "detect": cdtool.detect(log, MACHINE, signature=learned),
        "detect of many": cdtool.detect([log, GATE / "holdout" / "03.csv"], MACHINE, signature=learned),
        "detect_runs": cdtool.detect_runs(log, MACHINE, signature=learned),
        "explain": cdtool.explain(log, MACHINE, signature=folder / "gate.json"),
        "benchmark": result,
        "score": cdtool.score(ROOT / "docs" / "examples" / "triggers.csv", GATE / "benchmark.toml"),
        "compare": cdtool.compare(result.results, result.results),
        "plan": cdtool.plan(missed_at_most="5%"),
        "init": cdtool.init(log, folder / "draft.toml"),
        "study_sensors": cdtool.study_sensors(MACHINE),
    }
    rules = ("signature", "limit", "cusum", "trend", "limit_and_trend", "glr", "innovation", "sequential", "adaptive")
    for name in gate_runs.RULES if hasattr(gate_runs, "RULES") else rules:
        made[name] = name
    return made


def values_in(value: Any, seen: dict[int, Any] | None = None) -> Iterator[Any]:
    """Every dataclass instance in a value, in its fields and in what they contain; each once."""
    seen = {} if seen is None else seen
    if id(value) in seen:
        return
    seen[id(value)] = value
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        yield value
        for item in dataclasses.fields(value):
            yield from values_in(getattr(value, item.name), seen)
    elif isinstance(value, Mapping):
        for item in value.values():
            yield from values_in(item, seen)
    elif isinstance(value, list | tuple | set | frozenset) or type(value).__name__ in ("Rows", "DetectionResults"):
        for item in list(value)[:200]:
            yield from values_in(item, seen)
