"""The logs of a benchmark file without the files of their load cells, and the settings of its label file."""

from __future__ import annotations

from pathlib import Path

import pytest

from cdtool.base.errors import ConfigurationError, UsageError
from cdtool.base.settings import Place
from cdtool.commands.judging.named_logs import LogsOf, OnsetTable, labels_of, read_label_file
from cdtool.commands.judging.runs import find_logs
from cdtool.formats.machine_file import MachineFile, read_machine_file

MACHINE = '[machine]\ntype = "linear_axis"\ncoordinates = "load"\n[channels]\n'
MACHINE += 'time = { column = "t", unit = "s" }\nforce = { FORCE }\n'
CELL = 'column = "F", unit = "N", time = { column = "t", unit = "s" }, time_offset = 0.0'


def machine(folder: Path, force: str) -> MachineFile:
    (folder / "machine.toml").write_text(MACHINE.replace("FORCE", force), encoding="utf-8")
    return read_machine_file(folder / "machine.toml")


def logs(folder: Path) -> LogsOf:
    return LogsOf(folder, machine(folder, 'column = "F", unit = "N"'))


@pytest.mark.parametrize(
    ("force", "names"),
    [
        (f'file = "{{stem}}_cell.csv", {CELL}', ["01.csv", "02.csv", "03_cell.csv"]),
        (f'file = "{{name}}", {CELL}', ["01.csv", "01_cell.csv", "02.csv", "03_cell.csv"]),
        ('column = "F", unit = "N"', ["01.csv", "01_cell.csv", "02.csv", "03_cell.csv"]),
    ],
)
def test_the_file_of_a_logs_load_cell_is_not_a_log(tmp_path, force, names):
    for name in ("01.csv", "01_cell.csv", "02.csv", "03_cell.csv"):  # the last one has no log
        (tmp_path / name).write_text("t\n", encoding="utf-8")
    found = LogsOf(tmp_path, machine(tmp_path, force)).of(["*.csv"], Place("b.toml", "learn."))
    assert [path.name for path in found] == names


@pytest.mark.parametrize("key", ["labels_clock", "labels_zone", "not_contacts"])
def test_a_setting_of_labels_needs_a_label_file(tmp_path, key):
    value = {"labels_clock": "source", "labels_zone": "Z", "not_contacts": ("soft",)}[key]
    with pytest.raises(ConfigurationError, match=f"onset.{key}: is only for a label file"):
        read_label_file(OnsetTable(**{key: value}), Place("b.toml", "onset."), tmp_path)


def test_the_settings_of_the_labels_reach_the_file(tmp_path):
    rows = "recording,start_time,end_time,kind\n01.csv,2025-04-03T12:00,,hard\n01.csv,2025-04-03T12:01,,soft\n"
    (tmp_path / "labels.csv").write_text(rows, encoding="utf-8")
    settings = {"labels": "labels.csv", "labels_zone": "+02:00", "not_contacts": ("soft",)}
    of_file = read_label_file(OnsetTable(**settings), Place("b.toml", "onset."), tmp_path)
    labels = labels_of(of_file, logs(tmp_path), [tmp_path / "01.csv"])
    assert labels is not None and labels.kinds == ("hard",) and labels.clock == "source"
    assert labels.contacts["01.csv"][0].start == 1_743_674_400.0


@pytest.mark.parametrize("pattern", ["", ".", "/", "#", "#1"])
def test_a_pattern_that_is_a_folder_or_the_root_matches_nothing(pattern, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for base in (tmp_path, tmp_path.relative_to(tmp_path)):
        with pytest.raises(UsageError, match="no file matches"):
            find_logs([pattern], base, runs=True)


def test_an_empty_list_of_logs_is_an_error(tmp_path):
    with pytest.raises(UsageError, match="is empty"):
        find_logs([], tmp_path)
