"""What the Tab key completes: commands, options, and the values of options."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from typer import Context
from typer.main import get_command

from cdtool.commands.app import app
from cdtool.commands.console import completions
from cdtool.detectors import DETECTORS
from cdtool.recordings.operations import HOW_TO_CUT
from cdtool.thresholds import THRESHOLDS


def completed(*words):
    """The completions of the value of the last option or argument of a command."""
    *names, option, typed = words
    command = get_command(app)
    context = Context(command)
    for name in names:
        command = command.get_command(context, name)
        context = Context(command, parent=context)
    named = [item for item in command.params if option in item.opts]
    (parameter,) = named or command.params[:1]
    return [item.value for item in parameter.shell_complete(context, typed)]


def test_a_shell_completes_commands_options_and_values():
    script = Path(sys.executable).with_name("cdtool")
    for line, expected in (("det", "detect"), ("detect --dete", "--detectors"), ("detect -d fe", "feekf")):
        words = f"cdtool {line}".split()
        asked = {"COMP_WORDS": " ".join(words), "COMP_CWORD": str(len(words) - 1), "_CDTOOL_COMPLETE": "complete_bash"}
        done = subprocess.run([script], env=os.environ | asked, capture_output=True, text=True, check=True)
        assert done.stdout.split() == [expected]


def test_every_registered_name_is_a_completion():
    assert completions.detectors("") == [*DETECTORS.names(), *DETECTORS.short_names]
    assert completions.thresholds("") == THRESHOLDS.names()
    assert completed("detect", "--set", "operations=") == [f"operations={how}" for how in HOW_TO_CUT]


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("learn-signature", "--set", "threshold.name=cu"), ["threshold.name=cusum"]),
        (("learn-signature", "--set", "signature.r"), ["signature.rule="]),
        (("learn-signature", "--set", "signature.rule=t"), ["signature.rule=thesis"]),
        (("detect", "--set", "activation.latch="), ["activation.latch=true", "activation.latch=false"]),
        (("signature", "update", "--set", "ex"), ["execution.timeout_s=", "execution.retries="]),
        (("list", "KIND", "w"), ["writers"]),
        (("tune", "--set", "tune.ob"), ["tune.objective="]),
        (("inject", "--set", "inject.form"), ["inject.format="]),
        (("benchmark", "--set", "tune.ob"), []),
        (("score", "--set", "tri"), ["triggers.clock=", "triggers.listed_only="]),
        (("score", "--set", "th"), []),
        (("plan", "--detectors", "feekf,g"), ["feekf,gm"]),
        (("simulate", "--set", "fri"), ["friction="]),
    ],
)
def test_other_values_are_completed(words, expected):
    assert completed(*words) == expected


def test_a_file_is_left_to_the_shell():
    assert completed("benchmark", "FILE", "be") == []


HEAVY = ("numpy", "scipy", "pandas", "rich", "matplotlib", "numba")


def test_completing_a_value_imports_no_library_for_computing_or_drawing():
    code = f"""
import sys
from cdtool.commands.app import app
from typer.main import get_command
from typer import Context
group = get_command(app)
for name, option in (("benchmark", "--detectors"), ("tune", "--detectors"), ("list", "kind")):
    command = group.get_command(Context(group), name)
    parameter = next(item for item in command.params if option in (*item.opts, item.name))
    assert parameter.shell_complete(Context(command), ""), option
print([name for name in {HEAVY!r} if name in sys.modules])
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
