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


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("benchmrk", "unknown command 'benchmrk' (did you mean benchmark? known: benchmark, compare,"),
        ("protocol wrte", "unknown command 'wrte' (did you mean write? known: check, init, write)"),
        (
            "benchmark b.toml --detector gm",
            "unknown option --detector (did you mean --detectors? see ",
        ),
        ("benchmark b.toml --zzz", "unknown option --zzz (see "),
        ("convert a.mcap b.mcap --recover verifed", "--recover is 'verifed' (did you mean verified? known: all, ver"),
        ("simulate gat -o logs", "MACHINE is 'gat' (did you mean gate? known: arm, gate)"),
        ("benchmark", "FILE is missing (see "),
        ("tune b.toml", "--false-alarm-budget is missing (see "),
        ("plan results.json", "unexpected argument results.json (see "),
    ],
)
def test_a_wrong_word_is_one_line_with_the_nearest_one(words, said):
    done = cdtool(*words.split())
    assert done.status == 2 and done.out == "" and done.err.startswith(f"error: {said}") and done.err.count("\n") == 1


@pytest.mark.parametrize(("option", "value"), [("-j", "x"), ("--jobs", "0"), ("--jobs", "1.5")])
def test_a_wrong_number_is_named_with_its_option(option, value):
    done = cdtool("benchmark", "b.toml", option, value)  # the rest of the line is typer's, by its version
    assert done.status == 2 and done.err.startswith("error: --jobs") and value in done.err and done.err.count("\n") == 1
