"""What the page of an identification shows of a robot: friction per joint, unseen torque, motion, inertias."""

from __future__ import annotations

from functools import partial

from cdtool.commands.identify.identifying import IdentifiedMachine
from cdtool.commands.identify.identifying_robot import InertiaIdentification, RobotIdentification
from cdtool.commands.identify.robot.friction_choice import FrictionAnswer
from cdtool.commands.identify.robot.plots import draw_joint_frictions, draw_unseen_torques
from cdtool.commands.identify.words import (
    words_of_decision,
    words_of_robot,
)
from cdtool.report.html.page_tables import visible
from cdtool.report.html.sections_page import PageSection, images_of
from cdtool.report.number_text import number
from cdtool.report.table import Cell, Heading, Table, name_cell, number_cell, tabulate

_UNSEEN = (
    "Each part, a run or a fifth of the only one, is predicted by a fit to the other parts; shown is the run with the "
    "largest residual. The model has the friction that the machine file has afterwards. Torques are low-passed; lines "
    "are interrupted where a joint rests. The title has the RMS of the residual of all runs before and after."
)
_FRICTION = (
    "Measured torque less that of inertia and gravity, per interval of speed; bars are two standard errors between "
    "blocks of the log. Points that differ from the model by more than the bars: friction depends on more than speed."
)


def robot_sections(done: IdentifiedMachine) -> list[PageSection]:
    """Return the sections of a robot; none of an axis."""
    robot = done.robot
    if robot is None:
        return []
    sections = [_friction_section(robot), _inertia_section(robot.inertias)]
    lines = words_of_robot(robot, done.joints, len(done.runs))
    if lines:
        table = Table("robot", "The whole robot", (Heading("finding"),), [[Cell(visible(line))] for line in lines])
        sections.append(PageSection("Whole robot", (table,)))
    return sections


def _friction_section(robot: RobotIdentification) -> PageSection:
    rows = robot.rows
    fields = (
        (Heading("joint"), lambda item: name_cell(visible(item[0].joint))),
        (Heading("unit"), lambda item: Cell(item[0].units[1])),
        (Heading("torque, RMS", numeric=True), lambda item: number_cell(item[1].torque)),
        (Heading("old friction", numeric=True), lambda item: number_cell(item[1].before)),
        (Heading("new friction", numeric=True), lambda item: number_cell(item[1].after)),
        (Heading("between equal runs", numeric=True), lambda item: number_cell(item[2])),
        (
            Heading("used"),
            lambda item: Cell(words_of_decision(item[1]), tone="good" if item[1].answer is FrictionAnswer.NEW else ""),
        ),
    )
    title = "Torque that is not explained in what was left out of the fit, RMS"
    tables = (tabulate("torque", title, fields, rows), _forms_table(robot))
    figures = []
    unseen = [item for item in rows if item[0].evidence and item[0].evidence.unseen]
    if unseen:
        figures.append((partial(draw_unseen_torques, unseen), _UNSEEN))
    friction = [item[0] for item in rows if item[0].evidence and item[0].evidence.friction]
    if friction:
        figures.append((partial(draw_joint_frictions, friction), _FRICTION))
    return PageSection("Prediction of unseen runs, joints", tables, images_of(figures))


def _forms_table(robot: RobotIdentification) -> Table:
    rows = []
    for joint, friction, _ in robot.rows:
        for form, error in friction.errors.items():
            tone = "good" if form is friction.form else ""
            rows.append([name_cell(visible(joint.joint)), Cell(form.value, tone=tone), number_cell(error)])
    columns = (Heading("joint"), Heading("form of the friction"), Heading("RMS error", numeric=True))
    return Table("forms", "All forms that were compared", columns, rows)


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
