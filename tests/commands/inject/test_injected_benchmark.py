"""[inject] from file to results: recordings, folder, provenance, refusals, brackets, bad input."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

import cdtool
from cdtool.base.errors import ConfigurationError, OutputError, UsageError
from cdtool.commands.inject.injected_logs import read_injected
from cdtool.commands.inject.with_injected import section_of
from cdtool.commands.scoring.benchmark_file import read_benchmark_file
from cdtool.results.agreement import agreements
from tests.command import cdtool as command
from tests.commands.inject.known_drive import known_drive

GATE = Path(__file__).parents[3] / "sample_logs" / "gate"


@pytest.fixture
def gate(tmp_path: Path) -> Path:
    """The sample gate with its model, whose drive is known."""
    for name in ("machine.toml", "inject.toml"):
        shutil.copy(GATE / name, tmp_path / name)
    (tmp_path / "model.toml").write_text(known_drive(GATE), encoding="utf-8")
    for name in ("stiff", "soft", "holdout", "free"):
        (tmp_path / name).symlink_to(GATE / name)
    return tmp_path


def write(folder: Path, text: str, name: str = "case.toml") -> Path:
    head = (
        'machine = "model.toml"\ndetectors = ["gm", "pt"]\n[signature]\nforce = true\n'
        '[learn]\nlogs = ["free/03.csv", "free/04.csv"]\n'
    )
    path = folder / name
    path.write_text(f"{head}{text}", encoding="utf-8")
    return path


INJECT = (
    '[inject]\nlogs = ["holdout/03.csv"]\npositions = ["0.9m"]\n[inject.obstacles.stiff]\nstiffness_n_per_mm = 500\n'
)


def test_injected_contacts_are_scored_and_agree_with_the_real_ones(gate: Path) -> None:
    done = cdtool.benchmark(gate / "inject.toml")
    rows = {(row.group, row.detector): row for row in done.evaluated.summaries}
    assert rows["injected_stiff", "momentum"].detected == 8
    assert rows["injected_stiff", "momentum"].median_ms == pytest.approx(rows["stiff", "momentum"].median_ms, rel=0.1)
    stated = done.results.provenance["injected"]
    assert stated["injected_stiff"]["compared_with"] == "stiff"
    assert stated["injected_soft"]["contacts"] == 8
    found = {(item.detector, item.real_group): item for item in agreements(done.evaluated)}
    assert found["momentum", "stiff"].injected_count == 8
    assert found["momentum", "stiff"].real_count == 4


def test_the_recordings_are_made_once_and_again_after_a_change(gate: Path) -> None:
    path = write(gate, INJECT)
    cdtool.benchmark(path)
    made = gate / "injected" / "injected_stiff"
    first = {item.name: item.stat().st_mtime_ns for item in made.iterdir()}
    cdtool.benchmark(path)
    assert {item.name: item.stat().st_mtime_ns for item in made.iterdir()} == first
    write(gate, INJECT.replace("500", "400"))
    cdtool.benchmark(path)
    assert {item.name: item.stat().st_mtime_ns for item in made.iterdir()} != first


def test_the_same_seed_gives_the_same_bytes_and_the_jobs_do_not_matter(gate: Path) -> None:
    from cdtool.execution.workers import Workers

    path = write(gate, INJECT.replace('"holdout/03.csv"', '"holdout/*.csv"'))
    one = cdtool.inject(path, gate / "one")
    cdtool.inject(path, gate / "two", workers=Workers(2))
    for case in one.logs.cases:
        assert (gate / "one" / case.file).read_bytes() == (gate / "two" / case.file).read_bytes()
    assert (gate / "one" / "injected.json").read_bytes() == (gate / "two" / "injected.json").read_bytes()


@pytest.mark.parametrize("file_format", ["csv", "mcap", "parquet"])
def test_the_folder_is_a_benchmark_of_its_own(gate: Path, file_format: str) -> None:
    path = write(gate, INJECT)
    done = cdtool.inject(path, gate / "out", settings={"inject.format": file_format, "detectors": ["gm"]})
    (case,) = done.logs.cases
    assert case.file.endswith(file_format)
    results = cdtool.benchmark(gate / "out" / "benchmark.toml").results
    assert [(row.detector, row.outcome) for row in results.contacts] == [("momentum", "detected")]
    recording = cdtool.read(gate / "out" / case.file, gate / "out" / "machine.toml")
    free = cdtool.read(gate / "holdout" / "03.csv", gate / "machine.toml")
    before = recording["speed"].time < case.start
    np.testing.assert_allclose(
        recording["speed"].values[before], free["speed"].values[: len(before)][before], rtol=1e-12
    )
    assert np.max(recording["force"].values) == pytest.approx(case.peak_force, rel=0.01)
    assert read_injected(gate / "out").cases == done.logs.cases


def without_table(path: Path, table: str) -> None:
    lines, kept, skipping = path.read_text(encoding="utf-8").splitlines(), [], False
    for line in lines:
        if line.startswith("["):
            skipping = line.startswith(f"[{table}]")
        if not skipping:
            kept.append(line)
    path.write_text("\n".join(kept) + "\n", encoding="utf-8")


def test_without_a_controller_there_are_two_brackets_and_no_pure_torque(gate: Path) -> None:
    without_table(gate / "model.toml", "model.controller")
    results = cdtool.benchmark(write(gate, INJECT)).results
    groups = {row.group for row in results.contacts}
    assert groups == {"injected_stiff_frozen", "injected_stiff_stiff"}
    assert {row.detector for row in results.contacts} == {"momentum"}
    refused = [item for item in results.skipped if item.recording == "pure_torque"]
    assert len(refused) == 2
    assert "not tested by injected contacts" in refused[0].reason


def test_positions_and_stiffnesses_may_be_a_grid(gate: Path) -> None:
    grid = '[inject]\nlogs = ["holdout/03.csv"]\npositions = { from = "0.4m", to = "1.0m", count = 4 }\n'
    grid += "stiffnesses_n_per_mm = { from = 5, to = 500, per_decade = 1 }\n"
    section = section_of(read_benchmark_file(write(gate, grid)))
    assert [item.value for item in section.positions] == pytest.approx([0.4, 0.6, 0.8, 1.0])
    assert [item.name for item in section.obstacles] == ["5_n_per_mm", "50_n_per_mm", "500_n_per_mm"]


def test_the_folder_learns_from_the_same_parts_of_the_logs(gate: Path) -> None:
    path = write(gate, INJECT)
    text = path.read_text(encoding="utf-8").replace(
        '["free/03.csv", "free/04.csv"]', '[{ path = "free/*.csv", from = "0.5s", to = "1.2m" }]'
    )
    path.write_text(text, encoding="utf-8")
    assert command("inject", path, "-o", gate / "out").status == 0
    written = read_benchmark_file(gate / "out" / "benchmark.toml")
    assert {str(section) for section in written.learned_sections.values()} == {"from 0.5 s to 1.2 m of travel"}
    assert len(written.learned_sections) == len(written.learn) > 1
    limits = [
        [row.limit for row in cdtool.benchmark(item).results.contacts if row.detector == "momentum"]
        for item in (path, gate / "out" / "benchmark.toml")
    ]
    assert limits[0] == pytest.approx(limits[1], rel=1e-6)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("stiffness_n_per_mm = 500", ""), "give one of profile"),
        (("stiffness_n_per_mm = 500", 'profile = "en_12453"'), "en_12453_force_meter"),
        (("stiffness_n_per_mm = 500", "stiffness_n_per_mm = 500\nzzz = 1"), "zzz: unknown key"),
        (("stiffness_n_per_mm = 500", "force_n = [0, 5]\ndeflection_mm = [0]"), "deflection_mm"),
        (("stiffness_n_per_mm = 500", "force_n = [0, 5, 4]\ndeflection_mm = [0, 1, 2]"), "falls"),
        (("stiffness_n_per_mm = 500", 'stiffness_n_per_mm = 500\ncompare_with = "stiff"'), "compare_with"),
        (('"0.9m"', '"0.9"'), "give a number with its unit"),
        (('positions = ["0.9m"]', 'positions = { from = "1m", to = "0.5m" }'), "is not after from"),
        (("holdout/03.csv", "none/*.csv"), "no file matches"),
        (('positions = ["0.9m"]', 'positions = ["0.9m"]\njoint = "x"'), "joint"),
    ],
)
def test_a_wrong_section_names_its_key(gate: Path, change: tuple[str, str], message: str) -> None:
    with pytest.raises(ConfigurationError) as fault:
        read_benchmark_file(write(gate, INJECT.replace(*change)))
    assert message in str(fault.value)


def test_files_of_others_are_never_replaced(gate: Path) -> None:
    path = write(gate, INJECT)
    (gate / "injected").mkdir()
    (gate / "injected" / "notes.txt").write_text("mine", encoding="utf-8")
    with pytest.raises(OutputError, match="holds other files"):
        cdtool.benchmark(path)
    assert (gate / "injected" / "notes.txt").read_text(encoding="utf-8") == "mine"
    with pytest.raises(UsageError, match="not an empty folder"):
        cdtool.inject(path, gate / "injected")


def test_a_folder_of_cdtool_inject_is_used_and_stays_the_users(gate: Path) -> None:
    path = write(gate, INJECT)
    assert command("inject", path, "-o", gate / "injected").status == 0
    (gate / "injected" / "mine.txt").write_text("mine", encoding="utf-8")
    made = {item.name: item.stat().st_mtime_ns for item in (gate / "injected").rglob("*")}
    assert command("benchmark", path).status in (0, 3)
    assert {item.name: item.stat().st_mtime_ns for item in (gate / "injected").rglob("*")} == made
    done = command("benchmark", write(gate, INJECT.replace("0.9m", "0.8m")))
    assert done.status == 2
    assert "holds contacts that cdtool inject made with other settings" in done.err
    assert (gate / "injected" / "mine.txt").read_text(encoding="utf-8") == "mine"


@pytest.mark.parametrize("positions", ['["0.9m", "900mm"]', '["4s", "4000 ms"]'])
def test_a_position_that_is_given_twice_is_refused(gate: Path, positions: str) -> None:
    with pytest.raises(ConfigurationError, match="repeats a position"):
        read_benchmark_file(write(gate, INJECT.replace('["0.9m"]', positions)))
