"""The reasons in words, with the numbers of the logs."""

from __future__ import annotations

import math

import pytest

from cdtool.commands.identify.estimate import Missing, NotIdentifiable
from cdtool.commands.identify.words import (
    words_of_base_set,
    words_of_reason,
)


@pytest.mark.parametrize(
    ("missing", "numbers", "words"),
    [
        ((Missing.SECOND_SPEED,), {"speeds": 1.0}, "too few speeds: viscous friction cannot be told from Coulomb"),
        (
            (Missing.MORE_RECORDINGS,),
            {"value": -2.0, "standard_error": 1.0},
            "too few runs (its standard error is 50 %",
        ),
        ((Missing.MORE_RECORDINGS,), {}, "too few runs"),
        ((Missing.SATURATION,), {"largest_n": 552.0}, "the command never reached a limit (largest: 552)"),
        ((Missing.OTHER_CONTROLLER,), {"unexplained_share": 0.81}, "P and PI control, alone or under a position"),
        ((Missing.PAYLOAD,), {}, "not in these logs: runs with a known payload"),
        ((), {}, "these logs show only its sum with another parameter"),
    ],
)
def test_a_reason_states_the_numbers_that_show_it(missing, numbers, words) -> None:
    assert words_of_reason(NotIdentifiable("machine", "x", missing, numbers)).startswith(words)


SINGULAR = {"condition_number": math.inf, "uncertain_torque_share": 0.31}


def test_the_answer_about_the_base_parameters_has_its_numbers() -> None:
    numbers = {"condition_number": 122.3, "base_parameters": 36.0, "not_determined": 13.0}
    numbers["uncertain_torque_share"] = 2.0
    item = NotIdentifiable("machine", "base_parameters", (Missing.OTHER_MOTION, Missing.MORE_RECORDINGS), numbers)
    assert words_of_base_set(item).startswith(
        "the full set of base parameters is not identifiable from this motion: condition number 122, "
        "13 of 36 not determined; add a motion of all joints at once, more recordings"
    )
    singular = NotIdentifiable("machine", "base_parameters", (Missing.OTHER_MOTION,), {**numbers, **SINGULAR})
    assert "infinite, 13 of 36 not determined, together uncertain by 31 %" in words_of_base_set(singular)
    assert "in other motion; add a motion of all joints at once;" in words_of_base_set(singular)
