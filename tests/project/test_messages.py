"""What a message advises exists: every option, key and extra that a text of cdtool names."""

from __future__ import annotations

import ast
import re
import tomllib
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import typer

from cdtool.base.errors import installing
from cdtool.commands.app import app
from tests.project.pages import ROOT

OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]+")
# An option of so many commands is named without one.
COMMON = 6
# Texts of these modules are shown by these commands only, if the name of the module is not the command's.
SHOWN_BY = {
    "exit_status": {"compare"},
    "planning": {"plan"},
    "detection": {"detect"},
    "prepared": {"detect"},
    "recovering": {"convert"},
    "score_triggers": {"score"},
    "study_file": {"study new", "study", "study run"},
    "identification": {"identify"},
    "store": {"benchmark"},
    "console": {"benchmark"},
    # They declare the options of these commands.
    "options": {"detect", "convert"},
    "settings": {"learn-signature"},
    "settings_table": {"benchmark"},
    "benchmark_file": {"benchmark"},
}
# Names of a user's own in examples.
EXAMPLES = {"joint_name", "lift", "looks_like"}
# Of other programs, or of every command.
FOREIGN = {"--help", "--version", "--nthreads", "--upgrade"}


def options() -> dict[str, set[str]]:
    """Return the commands that have each option."""
    found = defaultdict(set)

    def walk(command: object, name: str) -> None:
        for inner, each in getattr(command, "commands", {}).items():
            walk(each, f"{name} {inner}".strip())
        for item in command.params:
            for option in (*item.opts, *item.secondary_opts):
                found[option].add(name)

    walk(typer.main.get_command(app), "")
    return found


OPTIONS = options()
COMMANDS = set().union(*OPTIONS.values()) - {""}


def texts(path: Path) -> Iterator[tuple[int, str]]:
    """Yield the texts of a module with their lines, without docstrings; what an f-string fills in is 1."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    inner = {id(part) for node in ast.walk(tree) if isinstance(node, ast.JoinedStr) for part in ast.walk(node)}
    alone = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
    for node in ast.walk(tree):
        if isinstance(node, ast.JoinedStr):
            yield (
                node.lineno,
                "".join(str(part.value) if isinstance(part, ast.Constant) else "1" for part in node.values),
            )
        elif isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in inner | alone:
            yield node.lineno, node.value


def shown_by(path: Path) -> set[str]:
    """Return the commands that a module belongs to; none for one that several commands use."""
    parts = [*path.relative_to(ROOT / "cdtool").parts[:-1], path.stem]
    names = {part.removesuffix("_command").replace("_", "-") for part in parts[1:]}
    own = {name for name in COMMANDS if parts[0] == "commands" and set(name.split()) & names}
    if "simulate" in parts:
        own |= {name for name in COMMANDS if name.startswith("simulate")}
    if {"signature", "learn", "learning"} & {*parts}:
        own |= {name for name in COMMANDS if "signature" in name} | {"detect"}
    return own.union(*(SHOWN_BY.get(part, set()) for part in parts))


def unresolved(text: str, commands: set[str]) -> list[str]:
    """Return the options in a text that the reader's command does not have."""
    wrong = []
    for match in OPTION.finditer(text):
        having = OPTIONS.get(match[0], set())
        named = {name for name in COMMANDS if re.search(rf"(?<![\w-]){name}\b(?!\])", text[: match.start()])}
        if match[0] in FOREIGN or len(having) >= COMMON or having & (commands | named):
            continue
        wrong.append(match[0])
    return wrong


TEXTS = [(path, *found) for path in sorted((ROOT / "cdtool").rglob("*.py")) for found in texts(path)]


def test_every_option_that_a_message_names_is_one_of_the_command_it_is_for():
    wrong = [
        f"{path.relative_to(ROOT)}:{line}: {option} in {text!r}"
        for path, line, text in TEXTS
        if "--" in text
        for option in unresolved(text, shown_by(path))
    ]
    assert not wrong, "\n".join(wrong)


def test_every_section_and_key_that_a_message_names_is_documented():
    pages = "\n".join(page.read_text(encoding="utf-8") for page in (ROOT / "docs").rglob("*.md"))
    words = set(re.findall(r"[a-z_0-9]+", " ".join(re.findall(r"`[^`\n]+`|```.*?```", pages, re.DOTALL))))
    wrong = []
    for path, line, text in TEXTS:
        named = re.findall(r"\[([a-z_]+)(?:\.[a-zA-Z_.0-9]+)?\] ?([a-z]+_[a-z_]+)?", text)
        keys = {word for pair in named for word in pair if word}
        keys |= set(re.findall(r"(?<![\w.:>?(-])([a-z_]+) = [\"'\[0-9tf]", text)) if " " in text else set()
        wrong += [f"{path.relative_to(ROOT)}:{line}: {key} in {text!r}" for key in sorted(keys - words - EXAMPLES)]
    assert not wrong, "\n".join(wrong)


def test_an_extra_is_installed_from_the_checkout_while_no_index_has_it():
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    for path, line, text in TEXTS:
        assert "cdtool[" not in text, f"{path}:{line}: say it by cdtool.base.errors.installing"
    for path in {path for path, *_ in TEXTS}:
        for name in re.findall(r"installing\([\"']([a-z0-9]+)[\"']\)", path.read_text(encoding="utf-8")):
            assert name in extras
    assert installing("urdf") == "pip install '.[urdf]'"
