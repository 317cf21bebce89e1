"""The choice of docs/make_wording.py, which shows the texts of two revisions side by side."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path
from textwrap import dedent

import pytest

from tests.project.pages import docs_script

BEFORE = {
    "cdtool/reader.py": '''
        def read(path, rows):
            """A docstring is not a message."""
            name = "neither is this text"
            if not rows:
                raise ReadError(f"{path}: holds no row at all", "look into the file first")
            raise ReadError(f"{path}: is damaged at {rows}", "get another copy of it")


        def check(table, number):
            raise table.fault("unit", "has no unit of time", f"give {number} of them")
        ''',
    "cdtool/notes.py": """
        def note(count):
            return Finding(f"{count} rows come late: sorted by time", "time")

        def other(count):
            return Finding(f"{count} values are beyond all bounds", "time")
        """,
    "cdtool/gone.py": """
        def gone():
            echo("this remark has no successor")
        """,
    "README.md": "A page.\n",
}
AFTER = {
    "cdtool/reader.py": '''
        def read(path, rows):
            """A docstring is not a message, and has changed."""
            name = "and this text is not"
            if not rows:
                raise ReadError(f"{path}: contains no row at all", "check the file first")
            raise ReadError(f"{path.name}: is damaged at {rows.first}", "get another copy of it")


        def check(table, number):
            raise table.fault("unit", "is missing a unit of time", f"give {number:g} of them")
        ''',
    "cdtool/facts.py": """
        class Rows:
            def sentence(self):
                return f"{self.count} rows are out of order: sorted by time"

        class Values:
            words = "{count:g} values are outside all bounds"
        """,
    "README.md": "Another page.\n",
}


@pytest.fixture(scope="module")
def script():
    return docs_script("make_wording")


@pytest.fixture
def repository(tmp_path: Path) -> Path:
    """A repository with two commits, tagged before and after."""
    environment = {**os.environ, "GIT_CONFIG_GLOBAL": os.devnull, "GIT_CONFIG_SYSTEM": os.devnull}

    def git(*arguments: str) -> None:
        command = ["git", "-c", "user.name=A", "-c", "user.email=a@b.c", "-C", str(tmp_path), *arguments]
        subprocess.run(command, check=True, capture_output=True, env=environment)

    git("init")
    for tag, files in (("before", BEFORE), ("after", AFTER)):
        git("rm", "-r", "--ignore-unmatch", "cdtool")
        for name, text in files.items():
            (tmp_path / name).parent.mkdir(exist_ok=True)
            (tmp_path / name).write_text(dedent(text).lstrip(), encoding="utf-8")
        git("add", "--all")
        git("commit", "-m", tag)
        git("tag", tag)
    return tmp_path


def pairs_of(script, root: Path):
    messages = [script.Revision(name, root).messages() for name in ("before", "after")]
    return script.changed_pairs(*messages, script.hunks_between("before", "after", root))


def test_changed_messages_are_paired_in_their_hunk_and_then_by_their_words(script, repository):
    assert [(pair.before.text, pair.after.text) for pair in pairs_of(script, repository)] == [
        ("{count} rows come late: sorted by time", "{self.count} rows are out of order: sorted by time"),
        ("{count} values are beyond all bounds", "{count:g} values are outside all bounds"),
        (
            "{path}: holds no row at all (look into the file first)",
            "{path}: contains no row at all (check the file first)",
        ),
        ("unit has no unit of time (give {number} of them)", "unit is missing a unit of time (give {number} of them)"),
    ]


def test_a_message_without_a_counterpart_is_counted(script, repository, tmp_path, capsys):
    target = tmp_path / "wording.md"
    assert script.main([str(target), "--before", "before", "--after", "after"], repository) == 0
    assert capsys.readouterr().out == "5 of 6 messages changed, 4 with a counterpart among 5\n"
    rows = target.read_text(encoding="utf-8").splitlines()
    assert len(rows) == 2 + 4 and rows[2].startswith(
        "| 1 | cdtool/notes.py:2, now cdtool/facts.py:3 | {count} rows come"
    )


def test_only_the_words_of_a_message_count(script):
    old = 'raise UsageError(f"{value:g} is below {least}", "give a larger number")\n'
    new = 'raise UsageError(f"{self.value:.3g} is below {min(known)}", "give a larger number")\n'
    other = 'raise UsageError(f"{value:g} is above {least}", "give a larger number")\n'
    words = [script.messages_in(text, "a.py")[0].words for text in (old, new, other)]
    assert words[0] == words[1] != words[2]


def test_a_seed_chooses_the_same_texts_again_and_another_one_others(script):
    assert script.chosen(range(500), 20, 15) == script.chosen(range(500), 20, 15) != script.chosen(range(500), 20, 16)
    assert script.chosen("abc", 20, 15) == [0, 1, 2]


def test_words_that_differ_are_marked_and_escaped(script):
    rows = script.side_by_side(["a < b", "is said"], ["a < b", "is reported here"])
    assert rows.splitlines() == [
        "<tr class=same><td>a &lt; b<td>a &lt; b",
        "<tr><td>is <del>said</del><td>is <ins>reported here</ins>",
    ]


def test_a_page_is_split_into_paragraphs_items_rows_and_lines_of_code(script):
    page = "# Title\n\nOne\ntwo.\n\n* three\n  four\n* five\n\n| a |\n| b |\n\n```sh\nsix\n\nseven\n```\neight\n"
    assert script.units_of(page) == [
        *("# Title", "One two.", "* three four", "* five", "| a |", "| b |"),
        *("```sh", "six", "seven", "```", "eight"),
    ]
