"""The command line fits in the head: bounds on the options and on the help of every command."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
import typer

from cdtool.commands.app import app
from tests.command import cdtool

# All options together; the most of one command; the longest help [lines]; the widest line.
ALL_OPTIONS, OPTIONS, LINES, COLUMNS = 150, 14, 40, 80


def commands(command: Any, name: str = "") -> Iterator[tuple[str, Any]]:
    """Yield every command below one and itself, with the words that call it."""
    yield name, command
    for inner in getattr(command, "commands", {}):
        yield from commands(command.commands[inner], f"{name} {inner}".strip())


def options(command: Any) -> list[str]:
    found = [item for item in command.params if item.param_type_name == "option" and item.name != "help"]
    return [item.opts[0] for item in found if not item.hidden]


EVERY = dict(commands(typer.main.get_command(app)))


def test_all_commands_have_at_most_so_many_options():
    assert sum(len(options(command)) for command in EVERY.values()) <= ALL_OPTIONS


@pytest.mark.parametrize("name", EVERY)
def test_a_command_has_few_options_and_a_short_help(name, monkeypatch):
    monkeypatch.setenv("COLUMNS", str(COLUMNS))
    shown = cdtool(*name.split(), "--help").out.splitlines()
    assert len(options(EVERY[name])) <= OPTIONS, options(EVERY[name])
    assert len(shown) <= LINES, "\n".join(shown)
    assert max(map(len, shown)) <= COLUMNS
