"""Exit statuses: derived from facts in one place, and documented as in the code."""

from __future__ import annotations

import re
from itertools import combinations
from pathlib import Path

import typer.main

from cdtool.base.exit_status import STATUSES, STATUSES_OF, ExitStatus, Fact, status_of
from cdtool.commands.app import app

ROOT = Path(__file__).parents[2]
ORDER = [2, 1, 3, 4, 0]
ALONE = {
    Fact.LIMIT_VIOLATED: 1,
    Fact.FORCE_VIOLATED: 1,
    Fact.WORSE: 1,
    Fact.LATER: 1,
    Fact.WRONG_USAGE: 2,
    Fact.NOTHING_USABLE: 2,
    Fact.INTERNAL_ERROR: 2,
    Fact.LOST: 3,
    Fact.LEFT_OUT: 3,
    Fact.NOTHING_ASSESSABLE: 3,
    Fact.INCONCLUSIVE: 4,
    Fact.INCOMPLETE: 4,
    Fact.INTERRUPTED: 130,
}


def commands() -> list[str]:
    found = []
    for name, command in typer.main.get_command(app).commands.items():  # type: ignore[attr-defined]
        inner = getattr(command, "commands", None)
        found += [f"{name} {item}" for item in inner] if inner else [name]
    return found


def test_each_fact_has_its_status_and_none_is_0():
    assert ALONE.keys() == set(Fact)
    assert {fact: int(status_of([fact])) for fact in Fact} == ALONE
    assert status_of([]) == 0


def test_with_several_facts_2_comes_before_1_before_3_before_4():
    facts = [fact for fact in Fact if fact is not Fact.INTERRUPTED]
    for size in (2, 3):
        for some in combinations(facts, size):
            assert status_of(some) == min((ALONE[fact] for fact in some), key=ORDER.index), some


def table_of(page: str) -> dict[int, str]:
    text = (ROOT / page).read_text(encoding="utf-8")
    rows = re.findall(r"^\| (\d+) \| ([^|]+) \|", text.partition("| status | meaning |")[2], re.MULTILINE)
    return {int(number): meaning.strip().replace("`", "") for number, meaning in rows}


def test_the_table_of_the_docs_is_that_of_the_code():
    assert table_of("docs/ci.md") == {int(status): meaning for status, meaning in STATUSES.items()}


def test_the_docs_list_the_statuses_of_each_command():
    text = (ROOT / "docs" / "ci.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| ([\d, ]+) \| ((?:`[a-z -]+`(?:, )?)+) \|", text, re.MULTILINE)
    documented = {name: numbers for numbers, names in rows for name in re.findall("`([^`]+)`", names)}
    assert documented == {name: ", ".join(str(int(item)) for item in sorted(of)) for name, of in STATUSES_OF.items()}


def test_every_command_has_its_statuses_listed():
    assert sorted(commands()) == sorted(STATUSES_OF)
    assert all({ExitStatus.OK, ExitStatus.UNUSABLE} <= of for of in STATUSES_OF.values())


def test_no_other_module_chooses_a_status():
    for path in sorted((ROOT / "cdtool").rglob("*.py")):
        chosen = re.findall(r"typer\.Exit\(([^)]*)\)|sys\.exit\(([^)\n]*)", path.read_text(encoding="utf-8"))
        for words in (one or other for one, other in chosen):
            assert words == "status" or words.startswith("status_of("), f"{path}: {words}"
