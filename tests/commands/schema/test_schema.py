"""The published schemas are those of the models; they accept every shipped file and refuse what cdtool refuses."""

from __future__ import annotations

import json
import runpy
import tomllib
from pathlib import Path

import jsonschema
import pytest

from cdtool.base.errors import ConfigurationError
from cdtool.commands.console.json_schema import KINDS, schema_of
from cdtool.commands.scoring.benchmark_file import read_benchmark_file
from cdtool.formats.machine_file import read_machine_file
from tests.command import cdtool

ROOT = Path(__file__).parents[3]
MADE = runpy.run_path(str(ROOT / "docs" / "make_schema.py"))
GATE = ROOT / "sample_logs" / "gate"
MACHINES = [*ROOT.glob("sample_logs/*/machine.toml"), *ROOT.glob("sample_logs/*/*/machine.toml")]
MACHINES += [ROOT / "docs" / "examples" / f"{name}.toml" for name in ("emps", "scara", "ur10e")]


def faults(kind: str, text: str) -> list[str]:
    values = json.loads(json.dumps(tomllib.loads(text), default=str))
    return [error.message for error in jsonschema.Draft7Validator(schema_of(kind)).iter_errors(values)]


@pytest.mark.parametrize("kind", KINDS)
def test_the_published_schema_is_what_the_command_prints(kind):
    text = (ROOT / "docs" / f"{kind}.schema.json").read_text(encoding="utf-8")
    assert text == MADE["written_text"](kind) == cdtool("schema", kind).out, "run python docs/make_schema.py"
    jsonschema.Draft7Validator.check_schema(json.loads(text))


@pytest.mark.parametrize("kind", ["benchmark", "protocol"])
def test_the_files_of_the_gate_follow_the_schema(kind):
    assert not faults(kind, (GATE / f"{kind}.toml").read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("transmission_ratio", "transmission_ratios", "transmission_ratios"),
        ('type = "linear_axis"', 'type = "linear_axes"', "linear_axes"),
        ("[channels]", "[channel]", "channel"),
        ('unit = "rpm"', "unit = 3", "3 is not"),
        ("[machine]\n", "[machine]\nlink_length = 3.0\n", "link_length"),
        ("[machine]\n", "[machine]\nstick_speed = -1.0\n", "-1.0"),
    ],
)
def test_the_schema_refuses_what_cdtool_refuses(tmp_path, old, new, said):
    text = (GATE / "machine.toml").read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "machine.toml"
    path.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(ConfigurationError):
        read_machine_file(path)
    assert any(said in fault for fault in faults("machine", path.read_text(encoding="utf-8")))


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("[activation]\ndebounce = 0\n", "0 is less than the minimum"),
        ('[threshold]\nname = "cusum"\nlead = 1\n', "valid under any"),
        ("[signature]\nsides = 'three'\n", "three"),
        ("[learn]\nuntill = 'onset'\n", "untill"),
    ],
)
def test_the_schema_of_a_benchmark_refuses_what_cdtool_refuses(tmp_path, more, said):
    head = f'machine = "{GATE / "machine.toml"}"\ndetectors = ["gm"]\n'
    logs = f'[impacts.stiff]\nlogs = ["{GATE}/stiff/*.csv"]\n'
    learn = "" if "[learn]" in more else f'[learn]\nlogs = ["{GATE}/free/*.csv"]\n'
    path = tmp_path / "benchmark.toml"
    path.write_text(head + more + learn + logs, encoding="utf-8")
    with pytest.raises(ConfigurationError):
        read_benchmark_file(path)
    assert any(said in fault for fault in faults("benchmark", path.read_text(encoding="utf-8")))


def test_an_unknown_kind_is_answered_with_the_nearest():
    found = cdtool("schema", "machines")
    assert found.status == 2 and "did you mean machine" in found.err
