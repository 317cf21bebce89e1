"""The published schema matches the dataclasses; real results follow it, wrong ones do not."""

from __future__ import annotations

import copy
import json
import runpy
from collections.abc import Callable
from dataclasses import fields
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from cdtool.commands.scoring.benchmark import benchmark
from cdtool.results.files.results_file import to_json
from cdtool.results.results import SCHEMA_VERSION, Results
from tests.results.full_results import FULL

ROOT = Path(__file__).parents[2]
MADE = runpy.run_path(str(ROOT / "docs" / "make_schema.py"))
VALIDATOR = jsonschema.Draft202012Validator(MADE["results_schema"]())


def values_of(results: Results) -> dict[str, Any]:
    loaded: dict[str, Any] = json.loads(to_json(results))
    return loaded


def faults(values: dict[str, Any]) -> list[str]:
    return [f"{error.json_path}: {error.message}" for error in VALIDATOR.iter_errors(values)]


def test_the_published_schema_is_up_to_date():
    assert MADE["FILE"] == ROOT / "docs" / "results.schema.json"
    assert MADE["FILE"].read_text(encoding="utf-8") == MADE["schema_text"](), "run python docs/make_schema.py"


def test_the_schema_is_valid_and_describes_every_field():
    schema = MADE["results_schema"]()
    jsonschema.Draft202012Validator.check_schema(schema)
    assert set(schema["properties"]) == {item.name for item in fields(Results)}
    for part in (schema, *schema["$defs"].values()):
        assert part["description"] and part["additionalProperties"] is False
        assert part["required"] == list(part["properties"])
        assert all(len(item["description"]) > 2 for item in part["properties"].values())


def test_the_gate_benchmark_follows_the_schema(tmp_path):
    logs = ROOT / "sample_logs" / "gate"
    for item in logs.iterdir():
        (tmp_path / item.name).symlink_to(item)
    more = """
[force]
profile = "en_12453_reducing_gap"
[points.edge]
logs = ["stiff/0[34].csv"]
[limits]
"*.*.missed" = { max = 0 }
"pt.stiff.p95_ms" = { max = 10 }
"""
    file = tmp_path / "limited.toml"
    sample, _, _ = (logs / "benchmark.toml").read_text(encoding="utf-8").partition("[limits]")
    file.write_text(sample + more, encoding="utf-8")
    results = benchmark(file, detectors=["pi", "pt"]).results
    rows = (results.contacts, results.exposure, results.recordings, results.forces, results.points, results.sweep)
    assert all(rows)
    assert {item.outcome for item in results.limits} == {"met", "violated"}
    assert not faults(values_of(results))


def test_every_kind_of_row_follows_the_schema():
    assert all(getattr(FULL, item.name) for item in fields(Results))
    assert not faults(values_of(FULL))


def change(where: str, value: object) -> Callable[[dict[str, Any]], None]:
    """Set one value, as contacts.0.outcome."""

    def make(values: dict[str, Any]) -> None:
        *path, last = where.split(".")
        place: Any = values
        for key in path:
            place = place[int(key) if key.isdecimal() else key]
        place[last] = value

    return make


@pytest.mark.parametrize(
    ("wrong", "value"),
    [
        ("schema_version", SCHEMA_VERSION - 1),
        ("unknown", 1),
        ("contacts.0.outcome", "not assessable"),
        ("contacts.0.onset_s", None),
        ("contacts.0.side", "left"),
        ("exposure.0.not_judged", {"gap": "much"}),
        ("forces.0.verdict", "maybe"),
        ("detectors", [1]),
    ],
)
def test_a_wrong_value_does_not_follow_it(wrong, value):
    values = copy.deepcopy(values_of(FULL))
    change(wrong, value)(values)
    assert faults(values)
