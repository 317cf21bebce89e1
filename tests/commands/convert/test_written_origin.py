"""The start of a log since 1970 is kept in its converted file, and in files converted from that."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cdtool.commands.convert.converting import convert
from cdtool.commands.convert.log_rows import ColumnRows
from cdtool.formats.channels.reading import survey
from tests.commands.convert.kinds import KINDS, needs
from tests.formats.container_files import assert_same, logged, machine_file, two_clocks

EPOCH = 1_700_000_000.25


def dated(path: Path) -> Path:
    """A table whose clock counts from 1970, in ms, and begins at a quarter of a second."""
    rows = "\n".join(f"{EPOCH * 1e3 + k * 2.5!r},{float(np.sin(k))!r},{float(np.cos(k))!r}" for k in range(200))
    path.write_text(f"time [ms],torque [N m],speed [rad/s]\n{rows}\n")
    return path


def known(folder: Path) -> Path:
    path = machine_file(folder)
    path.write_text(path.read_text().replace('"time", unit = "s"', '"time", unit = "ms"'))
    return path


@pytest.mark.parametrize("suffix", KINDS)
def test_a_table_on_an_epoch_keeps_its_start_through_a_container_and_back(suffix, tmp_path):
    needs(suffix)
    log, machine = dated(tmp_path / "run.csv"), known(tmp_path)
    original = logged(log, machine)
    assert original.origin == EPOCH and original.start == 0.0
    first = convert(log, tmp_path / f"out{suffix}", machine=machine)
    second = convert(first.files[0], tmp_path / "back.csv", machine=first.machine_files[0])
    for done in (first, second):
        found = logged(done.files[0], done.machine_files[0])
        assert found.origin == EPOCH
        assert_same(original, found, exact_time=done is first and suffix != ".mcap")


@pytest.mark.parametrize("suffix", KINDS)
def test_all_columns_of_several_clocks_keep_the_start_without_a_machine_file(suffix, tmp_path):
    needs(suffix)
    log = two_clocks(tmp_path / "run.mcap", start_ns=1_700_000_000_250_000_000)
    first = convert(log, tmp_path / f"out{suffix}")
    for path in first.files:
        again = convert(path, tmp_path / "again.csv", force=True)
        for name in (path, again.files[0]):
            assert ColumnRows(Path(name)).origin == ColumnRows(log).origin > 1.6e9


@pytest.mark.parametrize(
    ("head", "origin"),
    [
        ("# cdtool.source: a\n# cdtool.origin_s: 12.5\n", 12.5),
        ("# cdtool.origin_s: noon\n", 0.0),
        ("# cdtool.origin_s: nan\n", 0.0),
        ("# a note\n# cdtool.origin_s: 12.5\n", 0.0),
        ("", 0.0),
    ],
    ids=["written", "edited", "no number", "in a comment of another's", "none"],
)
def test_only_a_header_written_by_convert_states_the_start(head, origin, tmp_path):
    (tmp_path / "log.csv").write_text(head + "t [s],v\n" + "".join(f"{k / 10},{k % 7}\n" for k in range(50)))
    assert ColumnRows(tmp_path / "log.csv").origin == origin
    assert list(survey(tmp_path / "log.csv").columns) == ["t [s]", "v"]
