"""`cdtool coverage`: a map of the sample gate, its figure and its table."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import cdtool
from cdtool.errors import ConfigurationError
from cdtool.evaluation.coverage_map import CellKey
from tests.command import cdtool as command
from tests.workflows.injection.known_drive import known_drive

GATE = Path(__file__).parents[3] / "sample_logs" / "gate"


@pytest.fixture
def gate(tmp_path: Path) -> Path:
    """The sample gate with a small grid."""
    (tmp_path / "model.toml").write_text(known_drive(GATE), encoding="utf-8")
    for name in ("holdout", "free"):
        (tmp_path / name).symlink_to(GATE / name)
    text = (GATE / "coverage.toml").read_text(encoding="utf-8")
    for old, new in (
        ("count = 7", "count = 2"),
        ("from = 2, to = 500, per_decade = 2", "from = 5, to = 500, per_decade = 1"),
        ('["holdout/*.csv", "holdout/*.mcap"]', '["holdout/*.csv"]'),
        ('"pi", "feekf", "gm", "igm", "pt"', '"pi", "gm"'),
    ):
        assert old in text
        text = text.replace(old, new)
    (tmp_path / "coverage.toml").write_text(text, encoding="utf-8")
    return tmp_path


def test_the_stiffer_the_obstacle_the_sooner_and_inertia_misses_soft_ones(gate: Path) -> None:
    done = cdtool.coverage(gate / "coverage.toml")
    made = done.map
    assert made.positions == (0.3, 1.2)
    assert made.stiffnesses == (5e3, 5e4, 5e5)
    for position in made.positions:
        cells = [made.cells["momentum"][CellKey(position, stiffness)] for stiffness in made.stiffnesses]
        assert cells[0].latency_ms > cells[1].latency_ms > cells[2].latency_ms
    assert all(cell.contacts == 2 and not cell.missed for cell in made.cells["momentum"].values())
    assert all(cell.misses_most for key, cell in made.cells["pure_inertia"].items() if key.stiffness == 5e3)


def test_the_command_draws_the_map_and_prints_a_table(gate: Path) -> None:
    done = command("coverage", gate / "coverage.toml", "-o", gate / "map.png")
    assert done.status == 0
    assert (gate / "map.png").read_bytes().startswith(b"\x89PNG")
    assert "2 positions from 0.3 to 1.2 m" in done.out
    again = command("coverage", gate / "coverage.toml", "--json", "--detectors", "gm")
    cells = json.loads(again.out)["cells"]
    assert len(cells) == 6
    assert {cell["detector"] for cell in cells} == {"momentum"}


def test_positions_of_two_units_make_no_map(gate: Path) -> None:
    path = gate / "coverage.toml"
    text = path.read_text(encoding="utf-8").replace('{ from = "0.3m", to = "1.2m", count = 2 }', '["0.3m", "4s"]')
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigurationError, match="positions are in m and s"):
        cdtool.coverage(path)


def test_another_suffix_is_refused_before_anything_is_computed(gate: Path) -> None:
    done = command("coverage", gate / "coverage.toml", "-o", gate / "map.docx")
    assert done.status == 2
    assert not (gate / "injected_coverage").exists()


def test_two_obstacles_that_begin_alike_make_no_map(gate: Path) -> None:
    path = gate / "coverage.toml"
    bumper = "[inject.obstacles.bumper]\ndeflection_mm = [0, 10, 60]\nforce_n = [0, 500, 510]\n"
    path.write_text(f"{path.read_text(encoding='utf-8')}{bumper}", encoding="utf-8")
    with pytest.raises(ConfigurationError, match="bumper and 50_n_per_mm both begin with 50 N/mm"):
        cdtool.coverage(path)


def test_a_cell_and_the_table_have_the_range_of_the_brackets(gate: Path) -> None:
    text = (gate / "model.toml").read_text(encoding="utf-8")
    (gate / "model.toml").write_text(text.partition("[model.controller]")[0], encoding="utf-8")
    done = cdtool.coverage(gate / "coverage.toml", detectors=["gm"])
    cell = done.map.cells["momentum"][CellKey(0.3, 5e3)]
    assert cell.range_ms[1] > cell.range_ms[0] + 1.0
    printed = command("coverage", gate / "coverage.toml", "--detectors", "gm").out
    line = next(line for line in printed.splitlines() if line.startswith("momentum") and " 5 " in line)
    highest = max(done.map.cells["momentum"][CellKey(position, 5e3)].range_ms[1] for position in (0.3, 1.2))
    assert f"to {highest:.3g}" in line
