"""A wrong command, option or value on the command line is one line in the words of cdtool, and status 2."""

from __future__ import annotations

import pytest

from tests.command import cdtool


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
