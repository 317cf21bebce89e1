"""Files are bounded before they are parsed, and what is in bounds is parsed as tomllib and json parse it."""

from __future__ import annotations

import ast
import tomllib
import tracemalloc

import pytest

from cdtool.base.errors import ConfigurationError, MistakesError
from cdtool.base.files.bounded_loading import (
    MIB,
    MOST_TOML,
    ContentError,
    parse_own_json,
    parse_toml,
    read_toml,
)
from cdtool.base.settings import Place
from cdtool.commands.inject.injected_logs import read_injected
from tests.command import cdtool
from tests.project.pages import ROOT


def test_a_key_may_have_parts_and_a_list_many_numbers_on_one_line():
    document = f"a.b.'c d'.e = [{'0.5, 1.5,' * 100}]\n"
    assert parse_toml(document) == tomllib.loads(document)
    with pytest.raises(ContentError, match="a key of more than 16 parts at line 2"):
        parse_toml(f"\n{'a.' * 40}b = 1")


@pytest.mark.parametrize("line", ["a{}.b = 1", f"a{{}}{'.b' * 14} = 1", "[[a.b]]", "c{} = {{}}"])
def test_the_largest_toml_file_takes_less_than_300_mib(line):
    text = "\n".join(line.format(i) for i in range(2000))
    tracemalloc.start()
    parse_toml(text)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak / len(text) * MOST_TOML < 300 * MIB


@pytest.mark.parametrize(
    ("text", "lines", "rest"),
    [
        ('a = ["x"\nb = 1\n[t]\nc = 2\n', [1], {"b": 1, "t": {"c": 2}}),
        ('a = [\n "x",\n "y",\n\n[t]\nc = 2 m\nd = 4\n', [1, 6], {"t": {"d": 4}}),
        ('a = [\n "b=x"\n "y",\n]\nc = 1\n', [3], {"a": ["b=x"], "c": 1}),
        ("a = 1,5\n[t]\nb = 2\nc = [\n", [1, 4], {"t": {"b": 2}}),
    ],
)
def test_a_list_that_does_not_end_hides_nothing_behind_it(tmp_path, text, lines, rest):
    file, place = tmp_path / "benchmark.toml", Place("benchmark.toml")
    file.write_text(text, encoding="utf-8")
    assert read_toml(file, "a benchmark file", place) == rest
    assert all(f"at line {line}" in str(fault) for line, fault in zip(lines, place.mistakes, strict=True))


def test_a_text_that_does_not_end_does_not_hide_the_broken_lines_before_it(tmp_path):
    file = tmp_path / "benchmark.toml"
    file.write_text('a = 1,5\nb = """c\nd = 3\n', encoding="utf-8")
    with pytest.raises(MistakesError, match=r"at line 1(.|\n)*Unterminated string"):
        read_toml(file, "a benchmark file", Place("benchmark.toml"))


NESTED = "[" * 200_000
# These texts are not from a file, or the reader of a message catches what deep nesting raises.
PARSED_ELSEWHERE = {
    "cdtool/formats/machine_file.py": "the parameters of a machine, encoded two lines above",
    "cdtool/commands/console/console.py": "the result of a command, encoded two lines above",
    "cdtool/formats/messages/json_messages.py": "one message of a log, whose nesting is a reason",
    "cdtool/commands/protocol/document/words.py": "a file of the package",
    "cdtool/base/findings/kinds.py": "a file of the package",
    "cdtool/commands/init/names/units_in_names.py": "the table of units that ships with cdtool",
    "cdtool/commands/init/names/words.py": "the table of words that ships with cdtool",
}


def test_every_json_and_toml_of_a_file_goes_through_the_bounded_loader():
    parsing = {"json.load", "json.loads", "json.JSONDecoder", "tomllib.load", "tomllib.loads"}
    found = {
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "cdtool").rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Attribute) and ast.unparse(node) in parsing
    }
    assert found - {"cdtool/base/files/bounded_loading.py"} == set(PARSED_ELSEWHERE)


@pytest.mark.parametrize("text", [NESTED, f'{{"a": {NESTED}'])
def test_nested_brackets_are_one_line_in_every_file(tmp_path, text):
    for name in ("store.json", "injected.json", "results.json", "signature.json"):
        (tmp_path / name).write_text(text, encoding="utf-8")
    gate = ROOT / "sample_logs/gate"
    detect = ("detect", gate / "stiff/03.csv", "-m", gate / "machine.toml", "--signature", tmp_path / "signature.json")
    for arguments in (
        ("benchmark", gate / "benchmark.toml", "--store", tmp_path),
        ("report", tmp_path / "results.json", "-o", tmp_path / "r.md"),
        detect,
    ):
        outcome = cdtool(*arguments)
        (line,) = outcome.err.splitlines()
        assert (outcome.status, line.startswith("error: ")) == (2, True)
    with pytest.raises(ConfigurationError, match=r"injected\.json: is no manifest"):
        read_injected(tmp_path)
    with pytest.raises(ContentError, match="nested too deeply"):
        parse_own_json(text)
