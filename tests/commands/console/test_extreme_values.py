"""A number that no machine has, in a machine file: one line with key, value and next step, and no memory used up."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy.io import savemat

from cdtool.base.errors import CdtoolError
from cdtool.formats.machine_file import read_machine_file
from cdtool.formats.mat import Mat
from tests.command import FEW, cdtool
from tests.project.pages import ROOT

GATE = ROOT / "sample_logs/gate"
MODEL = (GATE / "model.toml").read_text(encoding="utf-8")
NUMBERS = tuple(re.finditer(r"\b(?P<key>[a-z_0-9]+) = (?P<value>-?[0-9][0-9.e+-]*)", MODEL))
EXTREME = ["1e300", "1e-300", "1e308", "-1e308", "1e15", "nan", "inf", "-inf"]
LOG = GATE / "stiff/03.csv"
FREE = [GATE / f"free/{number:02d}.csv" for number in range(3, 11)]
BENCHMARK = (
    'machine = "machine.toml"\ndetectors = ["gm"]\n[signature]\nforce = true\n'
    f'[learn]\nlogs = ["{FREE[0]}", "{FREE[1]}"]\n[impacts.stiff]\nlogs = ["{LOG}"]\n'
)
INJECT = f'[inject]\nlogs = ["{FREE[2]}"]\npositions = ["0.9m"]\nstiffnesses_n_per_mm = [50]\nfolder = "injected"\n'
COMMANDS = {
    "info": ("info", LOG, "-m"),
    "learn-signature": ("learn-signature", *FREE[:2], "-d", "gm", "-o", "s.json", FEW, "-m"),
    "detect": ("detect", LOG, "-d", "gm", "--set=threshold.limits=100", "-m"),
    "identify": ("identify", *FREE[:2], "-m"),
    "benchmark": ("benchmark",),
    "tune": ("tune", "--false-alarm-budget", "1/2op", "-o", "tuned.toml"),
    "inject": ("inject", "-o", "cases"),
}


def machine_file(folder, match, value):
    text = f"{MODEL[: match.start('value')]}{value}{MODEL[match.end('value') :]}"
    (folder / "machine.toml").write_text(text, encoding="utf-8", newline="\n")
    return folder / "machine.toml"


def run(command, machine, monkeypatch):
    monkeypatch.chdir(machine.parent)
    text = BENCHMARK + (INJECT if command == "inject" else "")
    (machine.parent / "benchmark.toml").write_text(text, encoding="utf-8", newline="\n")
    arguments = COMMANDS[command]
    return cdtool(*arguments, machine.name if arguments[-1] == "-m" else "benchmark.toml")


@pytest.mark.parametrize("value", EXTREME)
def test_no_number_of_a_machine_file_is_beyond_what_machines_have(tmp_path, value):
    for match in NUMBERS:
        with pytest.raises(CdtoolError) as fault:
            read_machine_file(machine_file(tmp_path, match, value))
        assert match["key"] in fault.value.message
        assert fault.value.hint


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("value", ["1e300", "-1e308", "1e15"])
def test_every_command_answers_an_extreme_ratio_in_one_line(tmp_path, monkeypatch, command, value):
    ratio = next(match for match in NUMBERS if match["key"] == "transmission_ratio")
    outcome = run(command, machine_file(tmp_path, ratio, value), monkeypatch)
    (line,) = outcome.err.splitlines()
    assert outcome.status == 2
    assert line.startswith("error: ")
    assert "transmission_ratio: is " in line
    assert "check the unit" in line


@pytest.mark.parametrize("command", ["info", "learn-signature"])
@pytest.mark.parametrize("value", ["1e12", "1e-12", "0.0"])
@pytest.mark.parametrize("key", ["motor_inertia", "load_mass", "transmission_ratio", "viscous_friction", "scale"])
def test_the_largest_and_smallest_numbers_make_no_traceback(tmp_path, monkeypatch, command, value, key):
    match = next(match for match in NUMBERS if match["key"] == key)
    outcome = run(command, machine_file(tmp_path, match, value), monkeypatch)
    assert outcome.status in (0, 2, 3)
    assert "Traceback" not in outcome.err


@pytest.mark.parametrize("ratio", [1.333, 1333.0])
@pytest.mark.parametrize("command", ["learn-signature", "benchmark", "tune"])
def test_a_travel_in_the_wrong_unit_is_named_before_it_takes_the_memory(tmp_path, monkeypatch, command, ratio):
    match = next(match for match in NUMBERS if match["key"] == "transmission_ratio")
    outcome = run(command, machine_file(tmp_path, match, ratio), monkeypatch)
    assert outcome.status == 2
    last = outcome.err.splitlines()[-1]
    assert re.search(r"a travel of 1[.0-9e+]+ m has more than 20,000 places of 0.002 m", last)
    assert "transmission_ratio or the position's unit may be wrong" in last


def test_dimensions_of_a_matlab_file_beyond_every_float_are_one_line(tmp_path):
    path = tmp_path / "log.mat"
    savemat(path, {"x": np.linspace(1.1, 1.9, 50)})
    content = bytearray(path.read_bytes())
    content[156:160] = (224).to_bytes(4, "little")  # the size of the dimensions: 56 of them
    path.write_bytes(content)
    with pytest.raises(CdtoolError, match=r"log\.mat: damaged at byte 128: a part of an array has 224 bytes"):
        Mat().columns(path)
