"""25 recordings with hostile names in every report: all parse, no active content, no file outside the folder."""

from __future__ import annotations

import json
import os
import re
import unicodedata
from pathlib import Path

import pytest

import cdtool
from tests.command import Outcome
from tests.command import cdtool as run

NAMES: tuple[bytes | str, ...] = (
    "<img src=x onerror=alert(1)>",
    "<script>alert(1)<script>",
    '"><svg onload=alert(1)>',
    "' onmouseover='alert(1)",
    "]]>&lt;b&gt;&amp;",
    "<!--",
    "{{7*7}}{% raw %}",
    "=cmd|' C'!A0",
    "@SUM(1+1)",
    "+1+1",
    "-2-3",
    "$x^2$ $$ \\frac{a}{",
    "..\\..\\evil",
    "%2e%2e%2fevil",
    "abc\u202egnp.exe\u2067",
    "\x1b[31mred\x07\x1b]0;title\x07",
    "one\ntwo\r\nthree\ttab",
    "n" * 240,
    "[click](javascript:alert(1)) | `code` **bold** @user",
    "\u2028line\u2029paragraph",
    "\ufeff\u200bnothing to see",
    b"\xff\xfe not UTF-8",
    "CON",
    " # ~ ; rm -rf $HOME",
    "\ufffe\U000e0041 tag characters",
)
# A pattern does not match names that begin with a dot.
SEEN = [name for name in NAMES if not os.fsdecode(name).startswith(".")]
GROUP = "<script>alert(2)</script> ../../up $y$ =1+1 \u202e" + "g" * 300
MACHINE = "<b onclick=alert(3)>gate</b> ${x} \u202e"
JOINT = "=leaf <i>|`x` $z$"
REPORTS = ("again.json", "again.html", "again.md", "again.xml", "again.csv", "again.svg")


@pytest.fixture(scope="module")
def bench(tmp_path_factory) -> tuple[Path, Outcome, Outcome]:
    """The folder, the output of `benchmark`, and the output of `report`."""
    folder = tmp_path_factory.mktemp("hostile")
    cdtool.simulate_gate(folder / "logs", {"free": 10, "stiff": len(NAMES), "holdout": 1}, seed=13)
    logs = folder / "logs"
    for path, name in zip(sorted((logs / "stiff").glob("*.csv")), NAMES, strict=True):
        given = name if isinstance(name, bytes) else name.encode()
        os.rename(os.fsencode(path), os.fsencode(path.parent) + b"/" + given + b".csv")  # noqa: PTH104
    machine = (logs / "machine.toml").read_text()
    named = f"name = {json.dumps(MACHINE)}\njoints = [{json.dumps(JOINT)}]"
    (logs / "machine.toml").write_text(machine.replace('name = "gate"', named), encoding="utf-8")
    (logs / "benchmark.toml").write_text(
        'machine = "machine.toml"\ndetectors = ["feekf", "gm"]\n[learn]\nlogs = ["free/*.csv"]\n'
        f'[holdout]\nlogs = ["holdout/*.csv"]\n[impacts.{json.dumps(GROUP)}]\nlogs = ["stiff/*.csv"]\n'
        'force_profile = "en_12453_reducing_gap"\n[onset]\nabove_n = 20.0\nback_to_n = 8.0\n'
        '[limits]\n"*.*.p95_ms" = { max = 40 }\n',
        encoding="utf-8",
    )
    made = run("benchmark", logs / "benchmark.toml", "-o", folder / "out")
    targets = [part for name in REPORTS for part in ("-o", folder / "out" / name)]
    again = run("report", folder / "out" / "results.json", *targets)
    return folder, made, again


def text(bench, name: str) -> str:
    return (bench[0] / "out" / name).read_bytes().decode("utf-8")


def test_both_commands_exit_with_the_status_of_the_limits(bench):
    _, made, again = bench
    assert (made.status, again.status) == (1, 1), made.err + again.err
    assert "Traceback" not in made.err + again.err


def test_nothing_is_written_outside_the_output_folder_and_every_file_name_is_plain(bench):
    folder = bench[0]
    assert {path.name for path in folder.iterdir()} == {"logs", "out"}
    names = {path.name for path in (folder / "out").iterdir()}
    assert {"results.json", "results.traces.json.gz", "report.html", "report.md", "junit.xml", "contacts.csv"} <= names
    assert all(re.fullmatch(r"[a-z0-9][a-z0-9._-]{0,80}", name) for name in names), names
    assert {path.parent for path in (folder / "out").rglob("*")} == {folder / "out"}


def test_terminal_output_has_no_control_characters(bench):
    for said in (bench[1].out, bench[1].err, bench[2].out, bench[2].err):
        active = {letter for letter in said if unicodedata.category(letter) in ("Cc", "Cf", "Cs", "Co", "Zl", "Zp")}
        assert active <= {"\n"}


@pytest.mark.parametrize("name", ["results.json", "again.json"])
def test_json_is_strict_and_holds_every_recording(bench, name):
    values = json.loads(text(bench, name), parse_constant=lambda word: pytest.fail(word))
    assert len(values["recordings"]) == len(SEEN) + 1
    assert len(values["contacts"]) == 2 * len(SEEN)


def test_a_report_written_again_is_the_same(bench):
    pairs = {"html": "report.html", "xml": "junit.xml", "csv": "contacts.csv", "json": "results.json"}
    for suffix, name in pairs.items():  # the folder's Markdown differs: it links its figures
        assert text(bench, f"again.{suffix}") == text(bench, name)
