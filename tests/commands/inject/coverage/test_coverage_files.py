"""The files of a map of `cdtool inject`: all cells as JSON."""

from __future__ import annotations

import json
from pathlib import Path

from cdtool.commands.inject.coverage.files import check_coverage_files, write_coverage
from tests.report.html.coverage_case import coverage_case


def test_the_json_has_the_reasons_and_the_speeds(tmp_path: Path) -> None:
    targets = [tmp_path / "map.json", tmp_path / "map.html"]
    write_coverage(coverage_case(), targets)
    values = json.loads(targets[0].read_text(encoding="utf-8"))
    assert values["most_telling"][0] == {
        "detector": "slow",
        "position": 0.5,
        "stiffness": 1e4,
        "speed": None,
        "reason": "missed_in_part",
    }
    assert values["speeds"] == [{"speed": None, "lowest": 0.2, "highest": 0.2}]
    assert len(values["cells"]) == 8
    check_coverage_files(targets, [])  # its own files may be rewritten
