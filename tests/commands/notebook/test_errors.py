"""What a notebook shows of an error: where it was called, what is wrong, what to do next; and slips that it catches."""

from __future__ import annotations

import pytest

import cdtool
from tests.commands.notebook.values import FREE, GATE, LOG, MACHINE


def shown(call):
    with pytest.raises(cdtool.CdtoolError) as caught:
        call()
    return caught.value._render_traceback_()


def test_an_error_is_shown_with_the_line_of_the_caller_and_a_next_step_and_without_the_frames_of_cdtool():
    lines = shown(lambda: cdtool.read(GATE / "stif" / "03.csv", MACHINE))
    assert len(lines) == 3
    assert lines[0].startswith("line ") and 'cdtool.read(GATE / "stif" / "03.csv", MACHINE)' in lines[0]
    assert lines[1] == f"RecordingError: {GATE / 'stif' / '03.csv'}: no such file"
    assert lines[2] == "next step: check the path"


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: cdtool.learn_signature(sorted(GATE.glob("fre/*")), MACHINE, "momentum"), "no log is given"),
        (lambda: cdtool.learn_signature(str(FREE[0]), MACHINE, "momentum"), "a single path, not a list of logs"),
        (lambda: cdtool.learn_signature(GATE / "free", MACHINE, "momentum"), "a single path, not a list of logs"),
        (lambda: cdtool.detect([], MACHINE, detector="gm", settings={"threshold.limits": 400}), "no log is given"),
        (lambda: cdtool.detect(LOG, MACHINE, settings={"threshold.limits": 400}), "no detector is given"),
        (lambda: cdtool.detect(LOG, MACHINE, detector="momentum"), "no threshold is given"),
        (lambda: cdtool.init_study([], "study"), "no log is given"),
        (lambda: cdtool.identify("free/*.csv", MACHINE, "out.toml"), "a single path, not a list of logs"),
    ],
)
def test_a_list_that_is_empty_or_is_no_list_is_refused_with_what_to_give(call, words):
    assert words in "\n".join(shown(call))
