"""What every command says: a line for Ctrl-C and missing memory, whole reasons, and no warnings of libraries."""

from __future__ import annotations

import gzip
import warnings
from unittest import mock

import numpy as np
import pytest

from cdtool.commands.app import _show_note
from cdtool.commands.console import console
from cdtool.results.results import Skipped
from tests.command import cdtool


@pytest.mark.parametrize("place", ["cdtool.commands.detecting.prepared.prepared", "cdtool.commands.app.app"])
def test_ctrl_c_exits_with_130_and_one_line(gate_folder, place):
    log = gate_folder / "stiff" / "01.csv"
    with mock.patch(place, side_effect=KeyboardInterrupt):
        done = cdtool("detect", log, "-m", gate_folder / "machine.toml", "-d", "gm", "--set=threshold.limits=400")
    assert (done.status, done.out, done.err) == (130, "", "interrupted\n")


def test_missing_memory_is_one_line(gate_folder):
    with mock.patch("cdtool.commands.detecting.prepared.prepared", side_effect=MemoryError):
        done = cdtool("detect", gate_folder / "stiff" / "01.csv", "-m", gate_folder / "machine.toml", "-d", "gm")
    assert done.status == 2 and done.err.startswith("error: not enough memory (") and done.err.count("\n") == 1


@pytest.mark.parametrize("folder", ["logs", "a/very/long/folder" * 20])
def test_a_left_out_log_has_its_whole_reason_and_its_name_once(capsys, folder):
    reason = "no column 'speed' (channel 'speed') (did you mean velocity? known: time, torque, velocity)"
    console.print_skipped([Skipped(f"{folder}/x.csv", f"/data/{folder}/x.csv: {reason}")])
    line = capsys.readouterr().err
    assert line.endswith(f"x.csv: {reason}\n")
    assert line.count("x.csv") == 1
    assert len(line) <= 301


BYTES = bytes(range(256)) * 4


@pytest.mark.parametrize(
    ("content", "step"),
    [
        (gzip.compress(b"\x89MCAP0\r\n" + BYTES), "unpack it first"),
        (b"(\xb5/\xfd" + BYTES, "unpack it first"),
        (b"PK\x03\x04" + BYTES, "save the sheet as CSV"),
    ],
    ids=["gzip", "zstd", "ZIP or Excel"],
)
def test_a_packed_log_or_a_workbook_gets_a_hint_how_to_convert_it(gate_folder, tmp_path, content, step):
    (tmp_path / "log.csv").write_bytes(content)
    done = cdtool(
        "detect", tmp_path / "log.csv", "-m", gate_folder / "machine.toml", "-d", "gm", "--set=threshold.limits=400"
    )
    assert done.status == 2 and step in done.err


@pytest.fixture
def shown(capsys, monkeypatch):
    monkeypatch.setattr(warnings, "showwarning", _show_note)
    return lambda: capsys.readouterr().err


@pytest.mark.filterwarnings("always")
def test_a_warning_of_numpy_is_not_shown(shown):
    with warnings.catch_warnings():
        warnings.simplefilter("always")
        warnings.showwarning = _show_note
        assert np.isnan(np.float64(0.0) / np.float64(0.0))
        warnings.warn("old name", DeprecationWarning, stacklevel=1)
        assert shown() == ""
        warnings.warn("kernels are recompiled", stacklevel=1)
        assert shown() == "note: kernels are recompiled\n"
