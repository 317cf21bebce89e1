"""What the Tab key completes: commands, options, and the values of options."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from typer import Context
from typer.main import get_command

from cdtool.cli import completions
from cdtool.cli.app import app
from cdtool.detectors import DETECTORS
from cdtool.operations import HOW_TO_CUT
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
    for line, expected in (("det", "detect"), ("detect --dete", "--detector"), ("detect -d fe", "feekf")):
        words = f"cdtool {line}".split()
        asked = {"COMP_WORDS": " ".join(words), "COMP_CWORD": str(len(words) - 1), "_CDTOOL_COMPLETE": "complete_bash"}
        done = subprocess.run([script], env=os.environ | asked, capture_output=True, text=True, check=True)
        assert done.stdout.split() == [expected]


@pytest.mark.parametrize("command", ["detect", "explain", "learn-signature"])
def test_detectors_are_completed_by_name_and_short_name(command):
    assert completed(command, "--detector", "f") == ["friction_ekf", "fused", "feekf", "fu"]
    assert set(completed(command, "-d", "p")) == {"pure_torque", "pure_inertia", "pt", "pi"}


def test_a_list_of_detectors_is_completed_at_its_last_name():
    assert completed("benchmark", "--detectors", "gm,k") == ["gm,kalman_momentum", "gm,kmo"]
    assert completions.detector_list("gm,g") == [], "each once"


def test_every_registered_name_is_a_completion():
    assert completions.detectors("") == [*DETECTORS.names(), *DETECTORS.short_names]
    assert completions.thresholds("") == THRESHOLDS.names()
    assert completions.operations("") == list(HOW_TO_CUT)


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("learn-signature", "--threshold", "cu"), ["cusum"]),
        (("learn-signature", "--rule", "t"), ["thesis"]),
        (("learn-signature", "--sides", "o"), ["one"]),
        (("learn-signature", "--align", "p"), ["position"]),
        (("signature", "update", "--operations", "m"), ["motion"]),
        (("list", "KIND", "w"), ["writers"]),
    ],
)
def test_other_values_are_completed(words, expected):
    assert completed(*words) == expected
