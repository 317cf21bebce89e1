"""A pressure of the contact beside the load cell: it changes no result, shows no contact, and is converted."""

from __future__ import annotations

from pathlib import Path

import pytest

import cdtool
from cdtool.base.errors import RecordingError
from tests.synthetic.pressure_rig import Run, write_pressure_rig


@pytest.fixture
def rig(tmp_path) -> Path:
    write_pressure_rig(tmp_path, [Run(), Run()])
    return tmp_path


def test_a_benchmark_is_the_same_with_and_without_it(rig):
    whole = cdtool.benchmark(rig / "benchmark.toml").results
    machine = rig / "machine.toml"
    lines = [line for line in machine.read_text(encoding="utf-8").splitlines() if "contact_pressure" not in line]
    machine.write_text("\n".join(lines), encoding="utf-8")
    bare = cdtool.benchmark(rig / "benchmark.toml").results
    assert whole.contacts == bare.contacts and whole.recordings == bare.recordings


def test_alone_it_does_not_show_a_contact(rig):
    machine = rig / "machine.toml"
    lines = [line for line in machine.read_text(encoding="utf-8").splitlines() if not line.startswith("force =")]
    machine.write_text("\n".join(lines), encoding="utf-8")
    with pytest.raises(RecordingError, match="no ground truth: none of 'force', 'label', 'event' is mapped"):
        cdtool.benchmark(rig / "benchmark.toml")
