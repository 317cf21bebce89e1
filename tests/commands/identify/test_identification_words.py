"""An excitation plan and the reasons in words, with the numbers of the logs."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from cdtool.commands.identify.axis.excitation import Excitation, PlannedMotion
from cdtool.commands.identify.estimate import Identified, Missing, NotIdentifiable
from cdtool.commands.identify.joint import JointIdentification
from cdtool.commands.identify.robot.friction_choice import FrictionAnswer, FrictionForm, JointFriction
from cdtool.commands.identify.robot.robot_evidence import RobotJointEvidence
from cdtool.commands.identify.robot.robot_excitation import JointDemand, JointMotion, PlannedRobotMotion
from cdtool.commands.identify.words import (
    listed_numbers,
    words_of_base_set,
    words_of_decision,
    words_of_joint_plan,
    words_of_plan,
    words_of_reason,
    words_of_robot_plan,
)

EXCITATION = Excitation((0.25,), 1.0, 0.26, 0.08, 0.003, 14.0, 70.0, 10, 0, 0.3)
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
        ((Missing.POSITION,), {}, "no position channel: a delay of the speed channel looks like damping"),
        ((Missing.PAYLOAD,), {}, "not in these logs: runs with a known payload"),
        ((), {}, "these logs show only its sum with another parameter"),
    ],
)
def test_a_reason_states_the_numbers_that_show_it(missing, numbers, words) -> None:
    assert words_of_reason(NotIdentifiable("machine", "x", missing, numbers)).startswith(words)


def test_numbers_are_listed_as_in_a_sentence() -> None:
    assert listed_numbers((0.0612, 0.2, math.nan)) == "0.0612, 0.2 and -"
    assert listed_numbers((0.2,)) == "0.2"


def test_the_answer_about_the_base_parameters_has_its_numbers() -> None:
    numbers = {"condition_number": 122.3, "base_parameters": 36.0, "not_determined": 13.0}
    item = NotIdentifiable("machine", "base_parameters", (Missing.OTHER_MOTION, Missing.MORE_RECORDINGS), numbers)
    assert words_of_base_set(item).startswith(
        "the full set of base parameters is not identifiable from this motion: condition number 122, "
        "13 of 36 not determined; add a motion of all joints at once, more recordings"
    )
    singular = NotIdentifiable("machine", "base_parameters", (Missing.OTHER_MOTION,), {"condition_number": math.inf})
    assert "condition number infinite; add a motion of all joints at once;" in words_of_base_set(singular)


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (FrictionAnswer.NEW, "new: viscous and Coulomb friction"),
        (FrictionAnswer.NOT_BETTER, "old: not better by more than one standard error"),
        (FrictionAnswer.NOT_MOVED, "old: the joint does not move"),
    ],
)
def test_a_decision_states_why_the_old_friction_stays(answer: FrictionAnswer, words: str) -> None:
    before = math.nan if answer is FrictionAnswer.NOT_MOVED else 4.0
    form = FrictionForm.FRICTION_ALONE if answer is FrictionAnswer.NEW else FrictionForm.PREVIOUS
    errors = {FrictionForm.FRICTION_ALONE: 3.0, FrictionForm.PREVIOUS: before}
    friction = JointFriction(0, form, Identified(()), (), errors, 30.0)
    assert friction.answer is answer
    assert words_of_decision(friction) == words


def test_the_plan_of_a_robot_has_its_numbers() -> None:
    plan = PlannedRobotMotion((JointDemand(0, 2.0, 0.56, 0.32, 0.56), JointDemand(1, 3.0, 1.0, 3.0, 1.0)), 23.0, 4.9)
    units = {"elbow": ("kg m2", "N m", "rad", "N m s/rad"), "lift": ("kg", "N", "m", "N s/m")}
    motion = RobotJointEvidence(JointMotion(0, EXCITATION, 0.5, 1.25))
    joints = [JointIdentification(name, units=unit, evidence=motion) for name, unit in units.items()]
    assert words_of_robot_plan(plan, joints) == (
        "23 s of all joints at once, each at its own frequencies (logged: 4.9 s): "
        "elbow over 2 rad at up to 0.56 rad/s (logged: 0.32 rad, 0.56 rad/s); lift over 3 m at up to 1 m/s (as logged)"
    )
    other = PlannedMotion(Missing.OTHER_MOTION, ("machine.constant_force",))
    assert words_of_joint_plan(other, joints[0]).endswith("(logged: 0.75 rad, up to 0.26 rad/s)")
