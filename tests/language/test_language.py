"""No refused phrase is in the project's texts."""

from __future__ import annotations

import io
import itertools
import tokenize
from functools import cache
from pathlib import Path

import pytest

from tests.language.checker import (
    ROOT,
    Hit,
    check,
    hits_in,
    main,
    versioned_files,
)
from tests.language.phrases import read_phrases
from tests.language.texts import strings_and_comments

PHRASES = {phrase.name: phrase for phrase in read_phrases()}
HERE = Path(__file__).parent


@cache
def all_hits() -> tuple[Hit, ...]:
    return tuple(check(versioned_files()))


def lines_of(text: str, suffix: str = ".py") -> list[int]:
    return sorted(hit.line for hit in hits_in(text, suffix, "file", PHRASES.values()))


@pytest.mark.parametrize("name", PHRASES)
def test_the_phrase_is_found_in_its_hit(name):
    hits = hits_in(PHRASES[name].hit, ".md", "page.md", [PHRASES[name]])
    assert [(hit.file, hit.line, hit.phrase.name) for hit in hits] == [("page.md", 1, name)]


@pytest.mark.parametrize("name", PHRASES)
def test_the_phrase_is_not_found_in_its_allowed_example(name):
    assert not list(hits_in(PHRASES[name].allowed, ".md", "page.md", [PHRASES[name]]))


def test_no_file_has_a_refused_phrase():
    refused = [str(hit) for hit in all_hits()]
    assert not refused, "\n".join(refused)


def test_strings_docstrings_comments_and_names_are_searched():
    assert lines_of((HERE / "every_kind.txt").read_text(encoding="utf-8")) == [2, 4, 4, 7, 9]


def test_a_name_is_searched_where_it_is_defined_only():
    assert lines_of("from room import gap_is_told\n\ngap_is_told(1)\n") == []  # language: an example
    text = "gap_is_told = 1\n\n\ndef report(\n    loss_is_told: bool,\n): ...\n"  # language: an example
    assert lines_of(text) == [1, 5]


def test_markdown_is_searched_without_code_and_addresses():
    page = "# Gaps\n\nA gap is\ntold. `is told`\n\n```text\nis told\n```\n"  # language: an example
    page += "\n[a page](is-told.md) is told\n"  # language: an example
    assert lines_of(page, ".md") == [3, 10]


@pytest.mark.parametrize(
    ("text", "suffix"),
    [
        ('x = "a gap is told"  # language: the word of the standard\n', ".py"),
        ("# a gap is told  # language: the word of the standard\n", ".py"),
        ('"""A gap is told.\n\nMore.\n"""  # language: the word of the standard\n', ".py"),
        ("A gap is told. <!-- language: the word of the standard -->\n", ".md"),
    ],
)
def test_a_line_is_exempt_with_its_reason(text, suffix):
    assert lines_of(text, suffix) == []


def test_the_command_prints_file_line_words_and_replacement(tmp_path, capsys):
    (tmp_path / "page.md").write_text("# Gaps\n\nA gap is told.\n", encoding="utf-8")  # language: an example
    (tmp_path / "clean.md").write_text("A gap is reported.\n", encoding="utf-8")
    assert main([str(tmp_path / "clean.md")], tmp_path) == 0
    assert capsys.readouterr().out == ""
    assert main([str(tmp_path / "page.md")], tmp_path) == 1
    instead = PHRASES["is-told"].instead
    assert capsys.readouterr().out == f'page.md:3: "is told": {instead} (is-told)\n'  # language: an example


@pytest.mark.parametrize(
    "file", ["tests/language/texts.py", "tests/project/test_docs.py", "cdtool/formats/csv/stamps.py"]
)
def test_strings_and_comments_are_those_of_the_tokenizer(file):
    source = (ROOT / file).read_text(encoding="utf-8")
    starts = [0, *itertools.accumulate(len(line) + 1 for line in source.split("\n"))]
    texts, begun = [], []
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        begin, end = (starts[row - 1] + column for row, column in (token.start, token.end))
        kind = tokenize.tok_name[token.type]
        if kind == "FSTRING_START":  # from Python 3.12 on, a formatted string is many tokens
            begun.append(begin)
        elif kind == "FSTRING_END":
            begin = begun.pop()
            kind = "STRING"
        if not begun and kind in ("STRING", "COMMENT"):
            texts.append((begin, source[begin:end]))
    assert len(texts) > 20
    assert [(found.start(), found[0]) for found in strings_and_comments(source)] == texts
