"""Bad input: one clear line with file, row or key and the next step; no traceback; other files are processed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from tests.command import Outcome, cdtool

HEADER = "t,i_motor,n_motor,phi,acc_x,load_cell,n_ref,i_ref"


def written(path: Path, text: str | bytes) -> Path:
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


@pytest.fixture
def good(gate_folder: Path) -> list[str]:
    return (gate_folder / "stiff" / "01.csv").read_text().splitlines()


@pytest.fixture
def detect(gate_folder: Path, feekf_signature: Path) -> Callable[..., Outcome]:
    def run(*logs: Path) -> Outcome:
        return cdtool("detect", *logs, "-m", gate_folder / "machine.toml", "-s", feekf_signature)

    return run


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("missing.csv", None, ("missing.csv", "no such file")),
        ("empty.csv", "", ("empty.csv", "empty")),
        ("header.csv", HEADER + "\n", ("header.csv", "no row of numbers")),
        ("picture.csv", b"\x89PNG\r\n\x1a\n" + bytes(200), ("picture.csv", "not a")),
        ("page.csv", "<!DOCTYPE html><html><body>404</body></html>\n", ("page.csv",)),
        ("notes.csv", "This is a text about a gate.\nNothing else.\n", ("notes.csv",)),
        ("column.csv", "t,i_motor\n0,1\n1,2\n2,3\n", ("column.csv", "n_motor")),
        (
            "word.csv",
            HEADER + "\n0,1,1,1,1,1,1,1\n1,1,fast,1,1,1,1,1\n2,1,1,1,1,1,1,1\n",
            ("word.csv", "line 3", "fast"),
        ),
        ("cut.mcap", b"\x89MCAP0\r\n" + bytes(40), ("cut.mcap",)),
        ("fake.mcap", b"not an mcap file at all", ("fake.mcap", "no row of numbers")),
        ("fake.mat", b"not a mat file at all", ("fake.mat", "no row of numbers")),
        ("odd.xyz", b"\x00\x01\x02\x03" * 50, ("odd.xyz", "not a")),
    ],
)
def test_a_bad_file_is_one_line_with_its_name_and_a_next_step(detect, tmp_path, name, content, words):
    path = tmp_path / name
    if content is not None:
        written(path, content)
    done = detect(path)
    assert done.status == 2, done
    assert done.out == "" and done.err.startswith("error: ") and done.err.count("\n") == 1, done.err
    assert all(word in done.err for word in words), done.err
    assert done.err.rstrip().endswith(")"), done.err  # the next step is in brackets


def test_backward_and_repeated_time_is_reported_and_the_rest_used(detect, tmp_path, good, gate_folder):
    lines = [*good[:3001], good[2500], *good[3001:4001], good[4000], *good[4001:]]
    path = written(tmp_path / "time.csv", "\n".join(lines) + "\n")
    told = cdtool("info", path, "-m", gate_folder / "machine.toml").out
    assert "1 time stamp runs backward" in told and "1 time stamp repeats" in told
    assert "3002" in told
    done = detect(path)
    assert done.status == 0 and "alarm" in done.out


def test_an_unknown_unit_in_the_machine_file_lists_the_known_ones(gate_folder, tmp_path):
    text = (gate_folder / "machine.toml").read_text().replace('"rpm"', '"rpms"', 1)
    machine = written(tmp_path / "machine.toml", text)
    done = cdtool("info", gate_folder / "stiff" / "01.csv", "-m", machine)
    assert done.status == 2 and "channels.speed.unit" in done.err and "did you mean rpm" in done.err


def test_names_from_files_cannot_control_the_terminal(detect, tmp_path):
    evil = tmp_path / "a\x1b[2Jb\u202ec.csv"
    written(evil, "")
    done = detect(evil)
    assert done.status == 2
    assert "\x1b" not in done.err and "\u202e" not in done.err


def test_a_folder_that_cannot_be_created_is_one_line(tmp_path, gate_folder, feekf_signature):
    blocked = written(tmp_path / "file", "in the way")
    done = cdtool("simulate", "gate", "--set", "free=1", "-o", blocked / "gate")
    assert done.status == 2 and done.err.count("\n") == 1 and "file" in done.err
    logs = sorted((gate_folder / "stiff").glob("*.csv"))
    arguments = ("-m", gate_folder / "machine.toml", "-s", feekf_signature)
    done = cdtool("detect", *logs, *arguments, "--plot", blocked / "plots")
    assert done.status == 2 and done.err.count("\n") == 1 and "file" in done.err


def test_a_wrong_signature_is_reported_once_for_many_logs(tmp_path, gate_folder):
    logs = sorted((gate_folder / "stiff").glob("*.csv"))
    done = cdtool("detect", *logs, "-m", gate_folder / "machine.toml", "-s", tmp_path / "none.json")
    assert done.status == 2 and done.err.count("\n") == 1 and "no such file" in done.err
