"""--quiet: the conclusion and what is wrong, without tables and progress, in every command that prints a table."""

from __future__ import annotations

import inspect
import re
import sys
from importlib import import_module

import pytest
import typer

from cdtool.commands.app import COMMANDS
from cdtool.results.files.results_file import to_json
from tests.command import Outcome, cdtool
from tests.synthetic.builds import build_results

# What these print is what they are asked for: nothing would be left of it.
ONLY_A_TABLE = {"info", "explain", "list", "plan", "schema", "store", "study", "signature show", "protocol"}
# These print what they wrote or drafted, and a bar on a terminal.
ONLY_A_BAR = {"convert", "init", "simulate"}
_HEADINGS = re.compile(r"^ *(detector|group|recording|stiffness|key|class|run) {2,}\w", re.MULTILINE)


def functions() -> dict[str, object]:
    """Return the function of each command and subcommand by name."""
    found: dict[str, object] = {}
    for name, place in COMMANDS.items():
        module, _, attribute = place.partition(":")
        command = getattr(import_module(module), attribute)
        if isinstance(command, typer.Typer):
            found |= {f"{name} {item.callback.__name__}": item.callback for item in command.registered_commands}
        else:
            found[name] = command
    return found


def source_of(function: object) -> str:
    """Return the text of the module of a command."""
    return inspect.getsource(sys.modules[inspect.unwrap(function).__module__])  # type: ignore[arg-type, attr-defined]


@pytest.mark.parametrize("name", sorted(functions()))
def test_a_command_that_prints_a_table_can_be_quiet(name):
    function = functions()[name]
    can_be_quiet = "quiet" in inspect.signature(function).parameters
    if name in ONLY_A_BAR:
        assert not can_be_quiet and "table(" not in source_of(function)
    elif name in ONLY_A_TABLE or name.split()[0] in ONLY_A_TABLE:
        assert not can_be_quiet
        assert "progress(" not in source_of(function) or name.startswith("signature")
    else:
        assert can_be_quiet, f"cdtool {name} has no --quiet"


def both(*arguments: object) -> tuple[Outcome, Outcome]:
    return cdtool(*arguments), cdtool(*arguments, "--quiet")


def test_quiet_compare_prints_the_verdict_and_what_is_worse_without_the_table(tmp_path):
    old, new = tmp_path / "old.json", tmp_path / "new.json"
    old.write_text(to_json(build_results({("gm", "stiff"): [40.0 + 0.1 * i for i in range(30)]})), encoding="utf-8")
    new.write_text(to_json(build_results({("gm", "stiff"): [60.0 + 0.1 * i for i in range(30)]})), encoding="utf-8")
    whole, quiet = both("compare", old, new)
    assert whole.status == quiet.status == 1
    assert _HEADINGS.search(whole.out) and not _HEADINGS.search(quiet.out)
    lines = quiet.out.splitlines()
    assert lines[-1] == whole.out.splitlines()[-1] and "worse" in lines[-1]
    assert len(lines) < 0.5 * len(whole.out.splitlines()) and any("slower by" in line for line in lines[:-1])


def test_quiet_compare_of_equal_builds_is_one_sentence(tmp_path):
    old = tmp_path / "old.json"
    old.write_text(to_json(build_results({("gm", "stiff"): [40.0 + 0.1 * i for i in range(30)]})), encoding="utf-8")
    quiet = cdtool("compare", old, old, "--quiet")
    assert quiet.status == 0 and len(quiet.out.splitlines()) <= 2 and not _HEADINGS.search(quiet.out)


def test_quiet_detect_counts_verdicts_and_contacts(gate_folder, feekf_signature):
    logs = sorted((gate_folder / "stiff").glob("*.csv"))
    arguments = ("detect", *logs, "-m", gate_folder / "machine.toml", "-s", feekf_signature)
    whole, quiet = both(*arguments)
    assert _HEADINGS.search(whole.out) and not _HEADINGS.search(quiet.out)
    count = len(logs)
    assert quiet.out.startswith(f"{count} operations: {count} alarm; {count} contacts: {count} detected")


@pytest.mark.parametrize(
    "arguments",
    [
        ("learn-signature", "FREE", "-m", "MACHINE", "-d", "gm", "-o", "OUT/gm.json"),
        ("identify", "FREE", "-m", "MACHINE"),
        ("signature", "check", "SIGNATURE", "FREE", "-m", "MACHINE"),
    ],
    ids=lambda arguments: " ".join(arguments[:2]),
)
def test_quiet_leaves_out_the_table_and_draws_no_bar(arguments, gate_folder, feekf_signature, tmp_path, monkeypatch):
    free = sorted((gate_folder / "free").glob("*.csv"))
    known = {"MACHINE": gate_folder / "machine.toml", "SIGNATURE": feekf_signature, "LOG": free[0]}
    given: list[object] = []
    for item in arguments:
        given += free if item == "FREE" else [known.get(item, item.replace("OUT", str(tmp_path)))]
    drawn: list[bool] = []

    def noted(what, *, pulses=False, quiet=False):
        from contextlib import nullcontext

        drawn.append(not quiet)
        return nullcontext()

    for name in list(sys.modules):
        if name.startswith("cdtool.commands.") and hasattr(sys.modules[name], "progress"):
            monkeypatch.setattr(f"{name}.progress", noted)
    done = cdtool(*given, "--quiet")
    assert done.status in (0, 1), done.err
    assert not any(drawn) and not _HEADINGS.search(done.out)
