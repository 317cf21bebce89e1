"""`cdtool inject -o map.html`: a map of the sample gate, its figure and its table."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import cdtool
from cdtool.commands.inject.coverage.coverage_map import CellKey
from tests.command import cdtool as command
from tests.commands.inject.known_drive import known_drive

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


def test_the_command_writes_the_map_and_prints_a_table(gate: Path) -> None:
    targets = [item for name in ("map.html", "map.json") for item in ("-o", gate / name)]
    done = command("inject", gate / "coverage.toml", *targets)
    assert done.status == 0
    page = (gate / "map.html").read_text(encoding="utf-8")
    assert page.count('<script type="application/json" class="trace">') > 6
    assert "pure_inertia: 4 of 12 missed" in page
    written = json.loads((gate / "map.json").read_text(encoding="utf-8"))
    assert {cell["telling"] for cell in written["cells"]} == {None, "scatter"}
    recordings = [item for cell in written["cells"] for item in cell["recordings"]]
    assert len(recordings) == 24 and all(item["recording"].endswith(".csv") for item in recordings)
    assert "2 positions from 0.3 to 1.2 m" in done.out
    again = command("inject", gate / "coverage.toml", "--json", "--set", "detectors=gm")
    cells = json.loads(again.out)["cells"]
    assert len(cells) == 6
    assert {cell["detector"] for cell in cells} == {"momentum"}
