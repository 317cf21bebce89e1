"""Ground truth as it comes, through the commands: a force vector, a load cell in its own file, labels with kinds."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

from cdtool.results.files.results_file import read_results
from tests.command import cdtool
from tests.commands.console.changed_logs import SAMPLES, folder_of

CELL = 'force = { column = "load_cell", unit = "kN" }'


@pytest.fixture(scope="module")
def plain(tmp_path_factory) -> Path:
    """A benchmark of two impacts and a hold-out with their results, from a single load cell in the log."""
    folder = tmp_path_factory.mktemp("plain")
    file = folder_of(folder, {"a": lambda _, force: force, "b": lambda time, force: force + 0.01 * time, "free": still})
    assert cdtool("benchmark", file, "-o", folder / "r.json").status == 0
    return folder


def still(_: np.ndarray, force: np.ndarray) -> np.ndarray:
    return force


def copy_of(plain: Path, folder: Path, force: str, more: str = "") -> Path:
    """Return the benchmark file of a copy with another entry for the force, and more lines at the end."""
    shutil.copytree(plain, folder, dirs_exist_ok=True)
    machine = (folder / "machine.toml").read_text(encoding="utf-8")
    (folder / "machine.toml").write_text(machine.replace(CELL, force), encoding="utf-8")
    file = folder / "benchmark.toml"
    file.write_text(file.read_text(encoding="utf-8") + more, encoding="utf-8")
    return file


def columns(path: Path) -> tuple[list[str], list[list[str]]]:
    lines = path.read_text(encoding="utf-8").splitlines()
    return lines[0].split(","), [line.split(",") for line in lines[1:]]


def write(path: Path, names: list[str], rows: list[list[str]]) -> None:
    path.write_text("\n".join([",".join(names), *(",".join(row) for row in rows)]) + "\n", encoding="utf-8")


def latencies(path: Path) -> dict[tuple[str, int], float | None]:
    return {(row.recording, row.contact): row.latency_ms for row in read_results(path).contacts}


def test_a_force_vector_has_the_latencies_of_the_cell_along_it(plain, tmp_path):
    file = copy_of(plain, tmp_path, 'force = { columns = ["fx", "fy", "fz"], unit = "kN" }')
    for log in (*tmp_path.glob("stiff/*.csv"), *tmp_path.glob("holdout/*.csv")):
        names, rows = columns(log)
        force = np.array([float(row[5]) for row in rows])
        axes = np.array([0.1, -0.2, 0.3]) + np.outer(force, [0.6, 0.0, -0.8])
        axes += np.random.default_rng(0).normal(0.0, 3e-4, axes.shape)
        vectors = ([f"{value:.7f}" for value in axis] for axis in axes)
        made = [[*row[:5], *vector, *row[6:]] for row, vector in zip(rows, vectors, strict=True)]
        write(log, [*names[:5], "fx", "fy", "fz", *names[6:]], made)
    done = cdtool("benchmark", file, "-o", tmp_path / "new.json", "-o", tmp_path / "new.html")
    assert done.status == 0, done.err
    assert "force: magnitude of fx, fy, fz" in " ".join(done.out.split())
    found, before = latencies(tmp_path / "new.json"), latencies(plain / "r.json")
    assert found.keys() == before.keys()
    assert list(found.values()) == pytest.approx(list(before.values()), abs=3.0)
    peaks = [
        [row.peak_force_n for row in read_results(path).contacts] for path in (tmp_path / "new.json", plain / "r.json")
    ]
    assert peaks[0] == pytest.approx(peaks[1], abs=5.0)
    assert "rest level of each removed" in " ".join(cdtool("info", log, "-m", tmp_path / "machine.toml").out.split())
    for command in ("detect", "explain"):
        assert cdtool(command, tmp_path / "stiff" / "a.csv", "-b", file).status == 0


def test_a_cell_in_its_own_file_has_the_latencies_of_one_in_the_log(plain, tmp_path):
    own = 'file = "{stem}_cell.csv", column = "F", unit = "kN", time = { column = "time", unit = "s" }'
    trigger = 'trigger = { log = "sync", file = "trig" }'
    file = copy_of(plain, tmp_path, f"force = {{ {own}, {trigger} }}")
    for log in (*tmp_path.glob("stiff/*.csv"), *tmp_path.glob("holdout/*.csv")):
        names, rows = columns(log)
        time = 1e-3 * np.array([float(row[0]) for row in rows])
        force = np.array([float(row[5]) for row in rows])
        off = 0.7 if log.stem == "b" else 0.6  # two logs with the same channels would be one that is scored twice
        sync = [str(int(0.5 <= at < off)) for at in time]
        write(
            log,
            [*names[:5], *names[6:], "sync"],
            [[*row[:5], *row[6:], on] for row, on in zip(rows, sync, strict=True)],
        )
        cell = np.arange(0.0, time[-1], 5e-4)
        values = np.column_stack([cell + 77.0, np.interp(cell, time, force), 5.0 * ((cell >= 0.5) & (cell < off))])
        write(
            log.with_name(f"{log.stem}_cell.csv"), ["time", "F", "trig"], [[f"{x:.6f}" for x in row] for row in values]
        )
    done = cdtool("benchmark", file, "-o", tmp_path / "new.json")
    assert done.status == 0, done.err
    found, before = latencies(tmp_path / "new.json"), latencies(plain / "r.json")
    assert list(found.values()) == pytest.approx(list(before.values()), abs=1.6)
    results = read_results(tmp_path / "new.json")
    digests = results.provenance["load_cell_sha256"]
    assert sorted(digests)[:2] == ["holdout/free.csv, free_cell.csv", "stiff/a.csv, a_cell.csv"]
    old = {row.recording: row.resolution_ms for row in read_results(plain / "r.json").contacts}
    assert all(row.resolution_ms > old[row.recording] for row in results.contacts)
    refused = cdtool("benchmark", file, "-o", tmp_path / "stiff" / "a_cell.csv", "--force")
    assert refused.status == 2 and "is read by this command" in refused.err
    refused = cdtool(
        *("convert", tmp_path / "stiff" / "a.csv", "-m", tmp_path / "machine.toml"),
        *("-o", tmp_path / "stiff" / "a_cell.csv", "--force"),
    )
    assert refused.status == 2 and refused.err

    (tmp_path / "stiff" / "a_cell.csv").unlink()
    done = cdtool("benchmark", file, "-o", tmp_path / "new.json")
    assert done.status == 3
    assert "left out: stiff/a.csv" in done.err and "'a_cell.csv' does not exist" in " ".join(done.err.split())
    assert {name for name, _ in latencies(tmp_path / "new.json")} == {"stiff/b.csv"}


def test_labels_in_ms_have_kinds_in_every_output_and_some_are_no_contacts(plain, tmp_path):
    limits = '[limits]\n"pi.stiff/head.missed" = { max = 0 }\n"pi.stiff/trunk.max_ms" = { max = 1 }\n'
    labels = 'labels = "labels.csv"\nnot_contacts = ["intended"]\n'
    file = copy_of(plain, tmp_path, CELL, f"{labels}{limits}")
    rows = ["stiff/a.csv,6266,6500,head", "stiff/a.csv,2000,2100,intended", "stiff/b.csv,6266,6500,trunk"]
    (tmp_path / "labels.csv").write_text("\n".join(["recording,start_ms,end_ms,kind", *rows]) + "\n", encoding="utf-8")
    names = ("new.json", "new.md", "new.xml", "new.html", "new.csv")
    done = cdtool("benchmark", file, *(part for name in names for part in ("-o", tmp_path / name)))
    assert done.status == 1
    assert "stiff/trunk.max_ms" in done.out and "stiff/head" in done.out
    assert "1 label of kind intended is not a contact" in " ".join(done.err.split())
    for name in names[1:4]:
        assert "stiff/head" in (tmp_path / name).read_text(encoding="utf-8")
    assert [row.kind for row in read_results(tmp_path / "new.json").contacts] == ["head", "trunk"]
    again = cdtool("report", tmp_path / "new.json", "-o", tmp_path / "again.md")
    assert "stiff/head" in again.out and "stiff/head" in (tmp_path / "again.md").read_text(encoding="utf-8")
    shown = cdtool(
        *("detect", tmp_path / "stiff" / "b.csv", "-m", tmp_path / "machine.toml", "-d", "pi"),
        *("--set=threshold.limits=5", f"--set=onset.labels={tmp_path}/labels.csv", "--set=onset.labels_clock=source"),
    )
    assert shown.status in (0, 3) and "Traceback" not in shown.err
    wrong = cdtool("detect", tmp_path / "x.csv", "-b", SAMPLES / "benchmark.toml", "--set=onset.labels_clock=source")
    assert wrong.status == 2 and "--set onset.labels_clock: is only for a label file" in wrong.err
