"""The sentence of every kind of finding, word for word; other tests compare kinds and numbers."""

from __future__ import annotations

import ast
import json
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

import cdtool.base.findings
from cdtool.base.findings import Finding, lines_of, remark
from cdtool.base.findings.kinds import kind_of

PACKAGE = Path(cdtool.__path__[0])
KINDS = tomllib.loads((PACKAGE / "base" / "findings" / "kinds.toml").read_text(encoding="utf-8"))
# Kind, numbers and sentence.
SENTENCES = json.loads(Path(__file__).with_name("sentences.json").read_text(encoding="utf-8"))


@cache
def sources() -> list[ast.AST]:
    """Return every node of the package's code outside of findings/."""
    files = [path for path in PACKAGE.rglob("*.py") if path.parent.name != "findings"]
    return [node for path in files for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))]


def literal_findings() -> Iterator[tuple[str, ast.expr]]:
    """Yield the kind and the numbers of every `Finding("kind", channel, numbers)`."""
    for node in sources():
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == "Finding":
            numbers = [keyword.value for keyword in node.keywords if keyword.arg == "numbers"]
            kinds = [item.value for item in ast.walk(node.args[0]) if isinstance(item, ast.Constant)]
            yield from ((str(kind), (*node.args[2:3], *numbers, ast.Dict([], []))[0]) for kind in kinds)


@pytest.mark.parametrize(("kind", "numbers", "sentence"), SENTENCES, ids=[kind for kind, _, _ in SENTENCES])
def test_a_finding_is_written_as_one_sentence(kind, numbers, sentence):
    assert Finding(kind, "", numbers).sentence == sentence


def test_every_kind_is_made_by_the_package():
    made = {kind for kind, _ in literal_findings()}
    texts = {node.value for node in sources() if isinstance(node, ast.Constant)}  # as in a tuple of kinds
    assert KINDS.keys() - made - {"remark"} <= {text for text in texts if "_" in str(text)}


def test_findings_in_the_code_have_a_known_kind_and_its_numbers():
    found = list(literal_findings())
    assert len(found) > 100 and {kind for kind, _ in found} <= KINDS.keys()
    for kind, numbers in found:
        if isinstance(numbers, ast.Dict) and None not in numbers.keys:
            named = [key.value for key in numbers.keys if isinstance(key, ast.Constant)]
            assert sorted(named) == sorted(kind_of(kind).numbers), kind


@pytest.mark.parametrize(
    ("kind", "numbers", "said"),
    [
        ("the recorder lost its clock", {}, r"not a kind of finding; a finding in words is remark\('\.\.\.'\)"),
        ("missing_values", {"count": 1}, r"'missing_values' has the numbers \('count', 'values'\), not \('count',\)"),
        ("no_clock", {"count": 1}, r"has the numbers \(\), not \('count',\)"),
    ],
)
def test_a_wrong_kind_or_number_is_an_error_where_the_finding_is_made(kind, numbers, said):
    with pytest.raises(ValueError, match=said):
        Finding(kind, "torque", numbers)


def test_a_finding_about_a_million_lines_holds_few_numbers():
    finding = Finding("blank_lines", "", lines_of(range(2, 2_000_002, 2)))
    assert finding.numbers == {"count": 1_000_000, "first": (2, 4, 6), "last": 2_000_000}
    assert finding.message == "1000000 lines (2, 4, 6, ...) skipped: blank"


def test_a_finding_names_its_channel_and_the_part_of_its_log():
    assert str(remark("late")) == "late"
    assert str(remark("late", "speed")) == "speed: late"
    assert str(Finding("remark", "speed", {"text": "late"}, file="b.mcap")) == "speed: b.mcap: late"
