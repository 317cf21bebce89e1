"""Common terminal output of the commands: lines that fit, and a message for Ctrl-C."""

from __future__ import annotations

import gzip
from unittest import mock

import pytest

from cdtool.base.errors import UsageError, nearest
from cdtool.commands.console import console
from cdtool.results.results import Skipped
from cdtool.truth.force.limits import read_force_limits
from tests.command import cdtool


@pytest.mark.parametrize("place", ["cdtool.commands.detecting.prepared.prepared", "cdtool.commands.app.app"])
def test_ctrl_c_exits_with_130_and_one_line(gate_folder, place):
    log = gate_folder / "stiff" / "01.csv"
    with mock.patch(place, side_effect=KeyboardInterrupt):
        done = cdtool("detect", log, "-m", gate_folder / "machine.toml", "-d", "gm", "--set=threshold.limits=400")
    assert (done.status, done.out, done.err) == (130, "", "interrupted\n")


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


def test_a_long_list_of_known_names_is_cut_between_names(capsys):
    known = read_force_limits()
    console.print_error(UsageError("a" * 200, nearest("yard", known)))
    line = capsys.readouterr().err.strip()
    listed, _, more = line.partition("known: ")[2].removesuffix(")").partition(" and ")
    shown = listed.split(", ")
    assert len(line) <= 300 and set(shown) < set(known) and len(shown) >= 2
    assert more == f"{len(known) - len(shown)} more"
