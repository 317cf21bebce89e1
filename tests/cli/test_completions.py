"""What the Tab key completes: commands, options, and the values of options."""

import pytest

from cdtool.cli import completions
from cdtool.detectors import DETECTORS
from cdtool.operations import HOW_TO_CUT
from cdtool.thresholds import THRESHOLDS
from tests.command import cdtool


@pytest.fixture
def completed(monkeypatch):
    """The completions of the last word, as bash asks for them."""

    def of(*words):
        monkeypatch.setenv("_CDTOOL_COMPLETE", "complete_bash")
        monkeypatch.setenv("COMP_WORDS", " ".join(("cdtool", *words)))
        monkeypatch.setenv("COMP_CWORD", str(len(words)))
        return cdtool().out.split()

    return of


def test_a_command_and_an_option_are_completed(completed):
    assert completed("det") == ["detect"]
    assert "--detector" in completed("detect", "--det")


@pytest.mark.parametrize("command", ["detect", "explain", "learn-signature"])
def test_detectors_are_completed_by_name_and_short_name(command, completed):
    assert completed(command, "--detector", "f") == ["friction_ekf", "feekf"]
    assert set(completed(command, "-d", "p")) == {"pure_torque", "pure_inertia", "pt", "pi"}


def test_a_list_of_detectors_is_completed_at_its_last_name(completed):
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
        (("list", "w"), ["writers"]),
    ],
)
def test_other_values_are_completed(words, expected, completed):
    assert completed(*words) == expected
