"""`cdtool inject -o map.html`: a map of the sample gate, its figure and its table."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest

import cdtool
from cdtool.base.errors import ConfigurationError
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


def test_positions_of_two_units_make_no_map(gate: Path) -> None:
    path = gate / "coverage.toml"
    text = path.read_text(encoding="utf-8").replace('{ from = "0.3m", to = "1.2m", count = 2 }', '["0.3m", "4s"]')
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigurationError, match="positions are in m and s"):
        cdtool.coverage(path)


def test_logs_of_clearly_different_speed_split_the_map(gate: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def by_log(speeds: Mapping[str, Sequence[float]]) -> dict[str, float | None]:
        return {log: 0.1 * (place + 1) for place, log in enumerate(speeds)}

    monkeypatch.setattr("cdtool.commands.inject.coverage.coverage.speed_classes", by_log)
    done = command("inject", gate / "coverage.toml", "--set", "detectors=gm")
    assert done.status == 0
    lines = [line.split()[1:5] for line in done.out.splitlines() if line.startswith("momentum ")]
    assert lines[:2] == [["5", "0.1", "2", "0"], ["5", "0.2", "2", "0"]]


def test_a_cell_and_the_table_have_the_range_of_the_brackets(gate: Path) -> None:
    text = (gate / "model.toml").read_text(encoding="utf-8")
    (gate / "model.toml").write_text(text.partition("[model.controller]")[0], encoding="utf-8")
    done = cdtool.coverage(gate / "coverage.toml", settings={"detectors": ["gm"]})
    cell = done.map.cells["momentum"][CellKey(0.3, 5e3)]
    assert cell.range_ms[1] > cell.range_ms[0] + 1.0
    printed = command("inject", gate / "coverage.toml", "--set", "detectors=gm").out
    line = next(line for line in printed.splitlines() if line.startswith("momentum") and " 5 " in line)
    highest = max(done.map.cells["momentum"][CellKey(position, 5e3)].range_ms[1] for position in (0.3, 1.2))
    assert f"to {highest:.3g}" in line


@pytest.mark.parametrize("name", ["map.html", "map.json"])
def test_a_file_of_another_program_is_kept(gate: Path, name: str) -> None:
    (gate / name).write_text("mine", encoding="utf-8")
    done = command("inject", gate / "coverage.toml", "-o", gate / name)
    assert done.status == 2
    assert "--force" in done.err
    assert (gate / name).read_text(encoding="utf-8") == "mine"
    assert not (gate / "injected_coverage").exists()


def test_the_file_that_is_read_is_never_overwritten(gate: Path) -> None:
    path = gate / "coverage.json"
    path.write_text((gate / "coverage.toml").read_text(encoding="utf-8"), encoding="utf-8")
    done = command("inject", path, "-o", path, "--force")
    assert done.status == 2
    assert "is read by this command" in done.err
