"""docs/errata.md and the tests of this folder name each other."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

FOLDER = Path(__file__).parent
PAGE = (FOLDER.parents[1] / "docs" / "errata.md").read_text(encoding="utf-8")
FILES = sorted(FOLDER.glob("test_chapter_*.py"))


def written_in(file: Path) -> set[str]:
    body = ast.parse(file.read_text(encoding="utf-8")).body
    return {node.name for node in body if isinstance(node, ast.FunctionDef) and node.name.startswith("test_")}


def named_in(text: str) -> list[str]:
    return re.findall(r"`(test_\w+)`", text)


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_the_section_of_a_chapter_names_tests_of_its_own_file(file):
    heading = f"## Chapter {file.stem.removeprefix('test_chapter_')}"
    (section,) = (part for part in re.split(r"^(?=## )", PAGE, flags=re.MULTILINE) if part.startswith(heading))
    assert f"`tests/errata/{file.name}`" in section
    assert named_in(section) and set(named_in(section)) <= written_in(file)


def test_the_page_names_every_test_and_no_other():
    assert len(FILES) == 5
    assert set(named_in(PAGE)) == set().union(*map(written_in, FILES))


def test_every_row_of_a_table_with_tests_ends_with_one():
    tables = [part for part in PAGE.split("\n\n") if part.startswith("|") and named_in(part)]
    assert len(tables) >= 6
    for table in tables:
        for row in table.strip().splitlines()[2:]:
            assert re.fullmatch(r"`test_\w+`", row.strip("| ").rpartition("| ")[2]), row
