"""The load cell's offset, measured on the logs of a benchmark, as part of every latency's resolution."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

import cdtool
from cdtool.base.errors import ConfigurationError
from cdtool.commands.scoring.benchmark import benchmark
from cdtool.commands.scoring.benchmark_file import BenchmarkFile, read_benchmark_file
from cdtool.commands.scoring.measured_synchronisation import with_synchronisation
from cdtool.results.results import Results

FILE = """
machine = "machine.toml"
detectors = ["momentum"]
[learn]
logs = ["free/*.csv"]
[signature]
force = true
[onset]
above_n = 20.0
back_to_n = 8.0
{setting}
[impacts.stiff]
logs = ["stiff/*.csv"]
[impacts.soft]
logs = ["soft/*.csv"]
"""
MEASURED = 'synchronisation = "measured"'


@pytest.fixture(scope="module")
def gate(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("gate")
    cdtool.simulate_gate(folder, {"free": 4, "stiff": 3, "soft": 3}, seed=5)
    return folder


def written(folder: Path, setting: str) -> Path:
    file = folder / "b.toml"
    file.write_text(FILE.format(setting=setting), encoding="utf-8")
    return file


@pytest.fixture(scope="module")
def setup(gate) -> BenchmarkFile:
    return read_benchmark_file(written(gate, MEASURED))


@pytest.fixture(scope="module")
def measured(setup) -> Results:
    return benchmark(setup).results


@pytest.fixture(scope="module")
def synchronisation(setup) -> float:
    """The measured offset of the gate [s]."""
    return with_synchronisation(setup)[0].synchronisation


def test_the_measured_offset_is_part_of_every_latencys_resolution_and_is_reported(gate, measured, synchronisation):
    plain = benchmark(written(gate, "")).results
    (note,) = [item for item in measured.findings if item.kind == "measured_synchronisation"]
    assert note.severity == "note" and "latencies are not corrected" in note.reason
    assert synchronisation > 0.0
    for ours, theirs in zip(measured.contacts, plain.contacts, strict=True):
        assert ours.resolution_ms == pytest.approx(theirs.resolution_ms + 1e3 * synchronisation)
        assert ours.latency_ms == theirs.latency_ms
    assert measured.provenance["synchronisation_s"] == "measured"


def test_a_late_load_cell_makes_the_resolution_coarser(gate, synchronisation, tmp_path):
    folder = tmp_path / "late"
    shutil.copytree(gate, folder)
    for log in (*folder.glob("stiff/*.csv"), *folder.glob("soft/*.csv")):
        names, *rows = (line.split(",") for line in log.read_text().splitlines())
        force = names.index("load_cell")
        late = ["0.0"] * 30 + [row[force] for row in rows[:-30]]
        for row, value in zip(rows, late, strict=True):
            row[force] = value
        log.write_text("\n".join(",".join(row) for row in (names, *rows)) + "\n")
    late_setup, _ = with_synchronisation(read_benchmark_file(written(folder, MEASURED)))
    assert late_setup.synchronisation > 0.02 > synchronisation


def test_without_an_assessable_contact_the_benchmark_stops_with_a_remedy(gate, tmp_path):
    folder = tmp_path / "quiet"
    shutil.copytree(gate, folder)
    rng = np.random.default_rng(1)
    for log in (*folder.glob("stiff/*.csv"), *folder.glob("soft/*.csv")):
        names, *rows = (line.split(",") for line in log.read_text().splitlines())
        for row in rows:
            row[names.index("load_cell")] = f"{1e-3 * rng.standard_normal():.6f}"
        log.write_text("\n".join(",".join(row) for row in (names, *rows)) + "\n")
    setup = read_benchmark_file(written(folder, MEASURED))
    with pytest.raises(ConfigurationError, match="measured, but not assessable: none of 6 logs") as raised:
        with_synchronisation(setup)
    assert "synchronisation_s" in str(raised.value.hint)


@pytest.mark.parametrize(
    "setting", ['synchronisation = "guessed"', 'synchronisation = "measured"\nsynchronisation_s = 0.001']
)
def test_a_wrong_setting_is_refused(gate, setting):
    with pytest.raises(ConfigurationError, match=r"onset[.:] ?synchronisation"):
        read_benchmark_file(written(gate, setting))
