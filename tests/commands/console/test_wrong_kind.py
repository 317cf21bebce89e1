"""A file of the wrong kind is named by its kind, and errors in a file are described in plain words."""

from __future__ import annotations

import copy
import json
import re

import pytest

from tests.command import cdtool

# Terms that only Python uses.
PYTHON = re.compile(
    r"[A-Z][a-z]+Error|NoneType|\bNone\b|\bTrue\b|\bFalse\b|[({\[]'|\w+\(\w+=|object is|argument|iterable"
)


@pytest.fixture(scope="module")
def files(gate_folder, feekf_signature, tmp_path_factory):
    results = tmp_path_factory.mktemp("kinds") / "results.json"
    done = cdtool("benchmark", gate_folder / "benchmark.toml", "--detectors", "pt", "-o", results)
    assert done.status == 0, done.err
    log = gate_folder / "stiff" / "01.csv"
    names = {"machine": "machine.toml", "benchmark": "benchmark.toml"}
    return {
        "signature": feekf_signature,
        "results": results,
        "log": log,
        **{kind: gate_folder / name for kind, name in names.items()},
    }


WORDS = {
    "signature": "a signature file",
    "results": "a results file",
    "machine": "a machine file",
    "benchmark": "a benchmark file",
    "log": "a table of numbers",
}


@pytest.mark.parametrize(
    ("command", "needed", "given"),
    [
        *((command, "results", given) for command in ("report", "compare") for given in WORDS if given != "results"),
        *(("signature show", "signature", given) for given in WORDS if given != "signature"),
        *(("detect", "signature", given) for given in ("results", "machine")),
        *(("info -m", "machine", given) for given in WORDS if given != "machine"),
        *(("benchmark", "benchmark", given) for given in WORDS if given != "benchmark"),
        *(("info", "recording", given) for given in ("signature", "results", "machine", "benchmark")),
    ],
)
def test_a_file_of_another_kind_is_named_by_its_kind(files, command, needed, given):
    file = files[given]
    arguments: dict[str, tuple[object, ...]] = {
        "report": ("report", file),
        "compare": ("compare", file, files["results"]),
        "signature show": ("signature", "show", file),
        "detect": ("detect", files["log"], "-m", files["machine"], "--signature", file),
        "info -m": ("info", files["log"], "-m", file),
        "benchmark": ("benchmark", file),
        "info": ("info", file),
    }
    done = cdtool(*arguments[command])
    assert done.status == 2 and done.err.count("\n") == 1
    assert f"{file}: is " in done.err and WORDS[given] in done.err and "older" not in done.err
    if needed != "recording":
        assert f"not a {needed} file" in done.err
    assert ("may be swapped with the signature" in done.err) == ((command, given) == ("info -m", "signature"))


def _changed(values: dict[str, object], path: tuple[str | int, ...], value: object) -> dict[str, object]:
    made = copy.deepcopy(values)
    place: object = made
    for key in path[:-1]:
        place = place[key]  # type: ignore[index]
    place[path[-1]] = value  # type: ignore[index]
    return made


@pytest.mark.parametrize(
    "path",
    [
        ("schema_version",),
        ("machine",),
        ("joints",),
        ("joints", 0),
        ("detector", "gains"),
        ("threshold", "rule"),
        ("threshold", "settings", "alignment"),
        ("safety_factor_set", "by"),
        ("activation",),
        ("activation", "debounce"),
        ("runs",),
        ("current", 0, "nominal_speed"),
        ("current", 0, "by_time", "window"),
        ("current", 0, "by_time", "mean"),
        ("normal_motion",),
    ],
)
@pytest.mark.parametrize("value", [True, -1.0, 1e300, [1, "a"], {"a": 1}], ids=str)
def test_errors_in_a_signature_file_are_in_plain_words(files, tmp_path, path, value):
    values = json.loads(files["signature"].read_text(encoding="utf-8"))
    wrong = tmp_path / "wrong.json"
    wrong.write_text(json.dumps(_changed(values, path, value)), encoding="utf-8")
    done = cdtool("signature", "show", wrong)
    assert done.status in (0, 2) and "Traceback" not in done.err
    assert not PYTHON.search(done.err.replace(str(wrong), "")), done.err


@pytest.mark.parametrize("value", ["true", "[[1], 2]", "{ a = 1 }", "[{ a = 1 }]"])
@pytest.mark.parametrize("key", ["machine", "detectors", "operations", "window_s", "learn", "onset"])
def test_errors_in_a_benchmark_file_are_in_plain_words(gate_folder, tmp_path, key, value):
    wrong = tmp_path / "wrong.toml"
    keys = {"machine": f'"{gate_folder}/machine.toml"', "detectors": '["pt"]', key: value}
    wrong.write_text("\n".join(f"{name} = {text}" for name, text in keys.items()), encoding="utf-8")
    done = cdtool("benchmark", wrong)
    assert done.status == 2 and not PYTHON.search(done.err.replace(str(tmp_path), "")), done.err
