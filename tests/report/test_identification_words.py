"""An excitation plan and the reasons in words, with the numbers of the logs."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from cdtool.identification.estimate import Missing, NotIdentifiable
from cdtool.identification.excitation import Excitation, PlannedMotion
from cdtool.report.identification_words import listed_numbers, words_of_plan, words_of_reason

EXCITATION = Excitation((0.25,), 1.0, 0.0, 0.26, 0.08, 0.003, 14.0, 70.0, 10, 0, 0.3)
RUNS = PlannedMotion(Missing.SECOND_SPEED, ("machine.viscous_friction",), 4, (0.06, 0.1), (0.25,), (1, -1), travel=1.4)


@pytest.mark.parametrize(
    ("plan", "words"),
    [
        (RUNS, "4 runs in each direction at 0.06 and 0.1 m/s each, beside those at 0.25 m/s, over 1.4 m"),
        (
            replace(RUNS, missing=Missing.REVERSALS, speeds=(0.25,), directions=(-1,)),
            "4 runs backward at 0.25 m/s, over 1.4 m",
        ),
        (
            PlannedMotion(
                Missing.ACCELERATION, ("machine.load_mass",), 4, (0.25,), (0.25,), (1,), 0.6, logged_acceleration=0.3
            ),
            "4 runs forward at 0.25 m/s, with an acceleration of at least 0.6 m/s² (logged: 0.3)",
        ),
        (
            PlannedMotion(
                Missing.START_UP, ("model.drive.stiffness",), 4, (0.25,), (0.25,), (1,), rest=0.3, motion=2.0
            ),
            "4 runs forward at 0.25 m/s, from a rest of at least 0.3 s and until 2 s later",
        ),
        (
            PlannedMotion(Missing.MORE_RECORDINGS, ("model.friction.static",), 18, (0.25,), (0.25,), (1,)),
            "18 more runs forward at 0.25 m/s",
        ),
        (
            PlannedMotion(Missing.HIGHER_RATE, ("model.drive.stiffness",), rate=1000.0),
            "logs with at least 1000 samples per second",
        ),
        (PlannedMotion(Missing.MOTOR_INERTIA, ("model.drive.stiffness",)), "the motor inertia from its data sheet"),
    ],
)
def test_a_plan_states_its_numbers(plan: PlannedMotion, words: str) -> None:
    assert words_of_plan(plan, "m") == words


@pytest.mark.parametrize(
    ("missing", "numbers", "excitation", "words"),
    [
        (
            (Missing.SECOND_SPEED,),
            {},
            EXCITATION,
            "1 speed (0.25 m/s): viscous friction cannot be told from Coulomb friction",
        ),
        ((Missing.SECOND_SPEED,), {"speeds": 1.0}, None, "1 held speed: viscous"),
        ((Missing.REVERSALS,), {}, EXCITATION, "one direction (100 %)"),
        (
            (Missing.MORE_RECORDINGS,),
            {"value": -2.0, "standard_error": 1.0},
            None,
            "its standard error is 50 % of its value",
        ),
        ((Missing.MORE_RECORDINGS,), {}, None, "too few runs"),
        ((Missing.SATURATION,), {"largest_n": 552.0}, None, "the command never reached a limit (largest: 552)"),
        ((Missing.PAYLOAD,), {}, None, "not in these logs: runs with a known payload"),
        ((), {}, None, "these logs show only its sum with another parameter"),
    ],
)
def test_a_reason_states_the_numbers_that_show_it(missing, numbers, excitation, words) -> None:
    assert words_of_reason(NotIdentifiable("machine", "x", missing, numbers), excitation, "m").startswith(words)


def test_numbers_are_listed_as_in_a_sentence() -> None:
    assert listed_numbers((0.0612, 0.2, math.nan)) == "0.0612, 0.2 and -"
    assert listed_numbers((0.2,)) == "0.2"
