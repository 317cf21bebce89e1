"""Figures of robots: which friction is in use, its residual, and the floor."""

from __future__ import annotations

import math

import numpy as np
import pytest

from cdtool.commands.identify.axis.excitation import excitation_of
from cdtool.commands.identify.axis.friction_curve import FrictionCurve
from cdtool.commands.identify.estimate import Identified
from cdtool.commands.identify.joint import JointIdentification
from cdtool.commands.identify.robot.friction_choice import FrictionAnswer, FrictionForm, JointFriction
from cdtool.commands.identify.robot.plots import draw_joint_frictions, draw_unseen_torques
from cdtool.commands.identify.robot.robot_evidence import JointFrictionCurve, RobotJointEvidence, UnseenTorque
from cdtool.commands.identify.robot.robot_excitation import JointMotion
from cdtool.report.plots.figures import encoded

Panel = tuple[JointIdentification, JointFriction, float]


def panel(answer: FrictionAnswer, name: str = "elbow", floor: float = math.nan) -> Panel:
    """Measured torque 10; 9 with the new friction, 7 with the old one."""
    time = np.linspace(0.0, 5.0, 101)
    form, whole = FrictionForm.FRICTION, np.full(101, 10.0)
    whole[40] = np.nan
    unseen = UnseenTorque("logs/03.csv", 4, form, time, whole, whole - 1.0, whole - 3.0)
    speed = np.linspace(-1.0, 1.0, 21)
    points = FrictionCurve(
        np.array([-0.5, 0.5]), np.array([-4.0, 4.0]), np.array([0.25, np.nan]), np.array([9, 1], dtype=np.int64)
    )
    curve = JointFrictionCurve(points, form, speed, 4.0 * np.sign(speed), 2.0 * np.sign(speed))
    used = form if answer is FrictionAnswer.NEW else FrictionForm.PREVIOUS
    friction = JointFriction(0, used, form, Identified(()), (), {form: 1.0, FrictionForm.PREVIOUS: 3.0}, 10.0)
    motion = JointMotion(0, excitation_of(*np.zeros((4, 0))), 0.0, 0.0)
    evidence = RobotJointEvidence(motion, unseen, curve)
    units = ("kg m2", "N m", "rad", "N m s/rad")
    return JointIdentification(name, units=units, robot=friction, evidence=evidence), friction, floor


@pytest.mark.parametrize(
    ("answer", "residual", "other", "title"),
    [
        (FrictionAnswer.NEW, 1.0, 3.0, "elbow, new friction: 3.00 → 1.00 N m"),
        (FrictionAnswer.NOT_BETTER, 3.0, 1.0, "elbow, old friction: 3.00 N m"),
    ],
)
def test_the_friction_in_use_is_the_one_of_the_machine_file(
    answer: FrictionAnswer, residual: float, other: float, title: str
) -> None:
    above, below = draw_unseen_torques([panel(answer)]).axes
    lines = {str(line.get_label()): np.asarray(line.get_ydata()) for line in below.get_lines()}
    assert np.nanmax(np.abs(lines["measured − model"] - residual)) < 1e-12
    assert np.nanmax(np.abs(lines["other friction"] - other)) < 1e-12
    assert np.isnan(lines["measured − model"][40])
    assert above.get_title(loc="left") == title
    (friction,) = draw_joint_frictions([panel(answer)[0]]).axes
    used = [line for line in friction.get_lines() if line.get_label() == "model"]
    assert np.max(used[-1].get_ydata()) == (4.0 if answer is FrictionAnswer.NEW else 2.0)


def test_the_floor_is_a_band_of_its_joint() -> None:
    figure = draw_unseen_torques([panel(FrictionAnswer.NEW, floor=0.5), panel(FrictionAnswer.NEW, "wrist")])
    shown = [axes for axes in figure.axes if axes.get_visible()]
    assert len(shown) == 4
    (band,) = [band for axes in shown for band in axes.collections if str(band.get_label()).startswith("between")]
    assert np.ptp(band.get_paths()[0].vertices[:, 1]) == pytest.approx(1.0)
    assert encoded(figure, ".png").startswith(b"\x89PNG")
