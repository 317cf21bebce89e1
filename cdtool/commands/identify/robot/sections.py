"""What the page of an identification shows of a robot: friction per joint, unseen torque, motion, inertias."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from cdtool.commands.identify.identification_outputs import JointEvidence, robot_plan_of
from cdtool.commands.identify.identifying import IdentifiedMachine
from cdtool.commands.identify.identifying_robot import InertiaIdentification, RobotIdentification
from cdtool.commands.identify.robot.plots import JointPanel, draw_joint_frictions, draw_unseen_torques
from cdtool.commands.identify.robot.robot_evidence import FrictionAnswer, decision_of, excitation_needs
from cdtool.commands.identify.words import (
    listed_numbers,
    short_number,
    words_of_decision,
    words_of_needs,
    words_of_robot,
)
from cdtool.report.html.page_tables import visible
from cdtool.report.html.sections_page import PageSection, images_of
from cdtool.report.number_text import NOTHING, number, percent
from cdtool.report.table import Cell, Heading, Table, name_cell, number_cell, tabulate

_UNSEEN = (
    "Each part, a run or a fifth of the only one, is predicted by a fit to the other parts; shown is the run with the "
    "largest residual. Torques are low-passed; lines are interrupted where a joint rests. The title has the RMS of the "
    "residual of all runs before and after."
)
_FRICTION = (
    "Measured torque less that of inertia and gravity, per interval of speed; bars are two standard errors between "
    "blocks of the log. Points that differ from the model by more than the bars: friction depends on more than speed."
)


def robot_sections(done: IdentifiedMachine, evidence: Sequence[JointEvidence]) -> list[PageSection]:
    """Return the sections of a robot; none of an axis."""
    robot = done.robot
    if robot is None:
        return []
    panels = _panels(done, evidence)
    sections = [_friction_section(done, robot, panels), _motion_section(evidence)]
    if robot.inertias is not None:
        sections.append(_inertia_section(robot.inertias))
    travel = [item.robot.units[1] if item.robot else "rad" for item in evidence]
    lines = words_of_robot(
        robot, robot_plan_of(done, evidence), [joint.joint for joint in done.joints], travel, len(done.runs)
    )
    if lines:
        table = Table("robot", "The whole robot", (Heading("finding"),), [[Cell(visible(line))] for line in lines])
        sections.append(PageSection("Whole robot", (table,)))
    return sections


def _panels(done: IdentifiedMachine, evidence: Sequence[JointEvidence]) -> list[JointPanel]:
    panels = []
    for place, item in enumerate(evidence):
        decision = decision_of(done, place)
        if decision is not None and item.robot is not None:
            robot = item.robot
            panels.append(JointPanel(item.joint, decision, robot.units, robot.unseen, robot.friction))
    return panels


def _friction_section(done: IdentifiedMachine, robot: RobotIdentification, panels: Sequence[JointPanel]) -> PageSection:
    tables = [_decision_table(panels), _forms_table(done, robot)]
    figures = []
    if any(panel.unseen is not None for panel in panels):
        figures.append((partial(draw_unseen_torques, panels), _UNSEEN))
    if any(panel.friction is not None for panel in panels):
        figures.append((partial(draw_joint_frictions, panels), _FRICTION))
    return PageSection("Prediction of unseen runs, joints", tuple(tables), images_of(figures))


def _decision_table(panels: Sequence[JointPanel]) -> Table:
    fields = (
        (Heading("joint"), lambda item: name_cell(visible(item.name))),
        (Heading("unit"), lambda item: Cell(item.units[0])),
        (Heading("torque, RMS", numeric=True), lambda item: number_cell(item.decision.torque)),
        (Heading("old friction", numeric=True), lambda item: number_cell(item.decision.before)),
        (Heading("new friction", numeric=True), lambda item: number_cell(item.decision.after)),
        (Heading("between equal runs", numeric=True), lambda item: number_cell(item.decision.floor)),
        (
            Heading("used"),
            lambda item: Cell(
                words_of_decision(item.decision), tone="good" if item.decision.answer is FrictionAnswer.NEW else ""
            ),
        ),
    )
    return tabulate("torque", "Torque that is not explained in what was left out of the fit, RMS", fields, panels)


def _forms_table(done: IdentifiedMachine, robot: RobotIdentification) -> Table:
    rows = []
    for name, joint in zip(done.joints, robot.joints, strict=True):
        for form, error in joint.errors.items():
            tone = "good" if form is joint.form else ""
            rows.append([name_cell(visible(name.joint)), Cell(form.value, tone=tone), number_cell(error)])
    columns = (Heading("joint"), Heading("form of the friction"), Heading("RMS error", numeric=True))
    return Table("forms", "All forms that were compared", columns, rows)


def _motion_section(evidence: Sequence[JointEvidence]) -> PageSection:
    rows = []
    for item in evidence:
        if item.robot is None:
            continue
        motion, travel = item.robot.motion, item.robot.units[1]
        moved = motion.excitation
        needs = excitation_needs(motion)
        rows.append(
            [
                name_cell(visible(item.joint)),
                Cell(travel),
                Cell(f"{short_number(motion.lowest)} to {short_number(motion.highest)}"),
                Cell(listed_numbers(moved.speeds, 2) if moved.speeds else NOTHING),
                number_cell(moved.highest_speed),
                number_cell(moved.highest_acceleration),
                Cell(percent(moved.forward_share) if motion.is_moving else NOTHING),
                number_cell(moved.moving_time),
                Cell(words_of_needs(needs) or "nothing", tone="unknown" if needs else "good"),
            ]
        )
    headings = (
        ("joint", False),
        ("unit", False),
        ("range", False),
        ("speeds that are held [/s]", False),
        ("highest speed [/s]", True),
        ("highest acceleration [/s²]", True),
        ("forward", False),
        ("moving time [s]", True),
        ("missing for its friction", False),
    )
    columns = tuple(Heading(heading, numeric=numeric) for heading, numeric in headings)
    table = Table("motion", "Logged motion of each joint", columns, rows)
    return PageSection("Excitation, joints", (table,) if rows else ())


def _inertia_section(found: InertiaIdentification) -> PageSection:
    base = found.base
    fields = zip(base.names, base.values, base.standard_errors, base.excitation, base.identifiable, strict=True)
    rows = [
        [
            Cell(visible(name)),
            number_cell(float(value)),
            number_cell(float(error)),
            Cell(f"{number(float(share))}", key=float(share)),
            Cell("yes" if known else "no", tone="" if known else "unknown"),
        ]
        for name, value, error, share, known in fields
    ]
    columns = (
        Heading("base parameter"),
        Heading("value", numeric=True),
        Heading("standard error", numeric=True),
        Heading("excitation", numeric=True),
        Heading("identifiable"),
    )
    note = (
        "Excitation: the part of a parameter's torque that no other parameter explains, relative to random motion of "
        "the same speeds. Values of parameters that are not identifiable are worthless."
    )
    table = Table("inertias", "Parameters that act on the torques, friction included", columns, rows)
    return PageSection("Inertias", (table,), note=note)
