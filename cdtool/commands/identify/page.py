"""The HTML page of an identification: one file in the style of the benchmark report, without script.

Text from logs and files is escaped by the template. A content security policy allows only this style and the figures.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from cdtool.base.plain_text import counted
from cdtool.commands.identify.evidence import CrossValidation
from cdtool.commands.identify.identifying import IdentifiedMachine
from cdtool.commands.identify.identifying_robot import InertiaIdentification, RobotIdentification
from cdtool.commands.identify.joint import JointIdentification
from cdtool.commands.identify.machine_update import MachineChange, values_text
from cdtool.commands.identify.plots import draw_controller, draw_friction, draw_starts, draw_unseen_run
from cdtool.commands.identify.robot.friction_choice import FrictionAnswer
from cdtool.commands.identify.words import (
    listed_numbers,
    words_of_decision,
    words_of_needs,
    words_of_reason,
    words_of_robot,
)
from cdtool.report.html.page_tables import visible
from cdtool.report.html.sections_page import PageSection, SectionsPage, images_of, left_out_sections
from cdtool.report.number_text import NOTHING, number, percent
from cdtool.report.table import Cell, Heading, Table, name_cell, number_cell, tabulate


def identification_html(done: IdentifiedMachine) -> str:
    """Return the page of one machine: changes, what is not identifiable, errors and misfit."""
    missing = sum(len(joint.not_identifiable) for joint in done.joints)
    known = sum(len(joint.estimates) for joint in done.joints)
    together = sum(len(joint.together) for joint in done.joints)
    sections = [PageSection("Changes", (_changes_table(done.changes),), note=_ORIGIN)]
    for joint in done.joints:
        sections += _joint_sections(joint, f"{joint.joint}: " if len(done.joints) > 1 else "")
    sections[1:1] = [*_robot_sections(done), PageSection("Excitation", (_excitation_table(done.joints),))]
    sections += left_out_sections(done.skipped, done.findings)
    return SectionsPage(
        "Identification",
        f"Model parameters of {visible(done.machine)}",
        f"{counted(known, 'value')} identified, {together} known only together, {missing} not identifiable",
        f"From {counted(len(done.runs), 'impact-free run')}.",
        "unknown" if missing else "good",
        (done.machine, counted(len(done.runs), "run")),
        tuple(section for section in sections if section.tables or section.images or section.note),
    ).html()


_ORIGIN = (
    "A value without a standard error is not identifiable alone: it is valid only together with the other values of "
    "its table. The old value stays in a comment of the machine file."
)


def _joint_sections(joint: JointIdentification, name: str) -> list[PageSection]:
    return [
        PageSection(f"{name}Not identifiable", (_missing_table(joint),) if joint.not_identifiable else ()),
        *_figure_sections(joint, name),
        PageSection(f"{name}Methods not used", (_refused_table(joint),) if joint.refused else ()),
    ]


def _changes_table(changes: Sequence[MachineChange]) -> Table:
    fields = (
        (Heading("key"), lambda item: Cell(f"{item.section}.{item.key}")),
        (Heading("old", numeric=True), lambda item: Cell(values_text(item.old))),
        (Heading("new", numeric=True), lambda item: Cell(values_text(item.values))),
        (Heading("standard error", numeric=True), lambda item: Cell(values_text(item.standard_errors, 2))),
        (Heading("unit"), lambda item: Cell(item.unit)),
        (Heading("origin"), lambda item: Cell(item.method.value)),
        (Heading("valid"), lambda item: Cell("alone" if item.is_known_alone else "only with its table")),
    )
    return tabulate("changes", "Values of the machine file", fields, changes)


def _missing_table(joint: JointIdentification) -> Table:
    fields = (
        (Heading("parameter"), lambda item: Cell(f"{item.section}.{item.key}")),
        (Heading("because"), lambda item: Cell(words_of_reason(item))),
        (Heading("add"), lambda item: Cell(words_of_needs(item.missing) or NOTHING)),
    )
    return tabulate("missing", "Not identifiable from these logs", fields, joint.not_identifiable)


def _excitation_table(joints: Sequence[JointIdentification]) -> Table:
    fields = (
        (Heading("joint"), lambda item: name_cell(visible(item[0].joint))),
        (Heading("unit"), lambda item: Cell(item[0].units[2])),
        (Heading("speeds that are held [/s]"), lambda item: Cell(listed_numbers(item[1].speeds) or NOTHING)),
        (Heading("highest speed [/s]", numeric=True), lambda item: number_cell(item[1].highest_speed)),
        (Heading("acceleration, RMS [/s²]", numeric=True), lambda item: number_cell(item[1].acceleration)),
        (Heading("of which noise [/s²]", numeric=True), lambda item: number_cell(item[1].acceleration_noise)),
        (Heading("forward"), lambda item: Cell(percent(item[1].forward_share) if item[1].moving_time else NOTHING)),
        (Heading("moving time [s]", numeric=True), lambda item: number_cell(item[1].moving_time)),
    )
    rows = [(joint, joint.excitation) for joint in joints if joint.excitation]
    return tabulate("excitation", "What the logged motion excites", fields, rows)


def _figure_sections(joint: JointIdentification, name: str) -> list[PageSection]:
    """Return the figures of a joint: how well the model describes its logs."""
    sections, units = [], (joint.units[1], f"{joint.units[2]}/s", joint.units[2])
    if joint.evidence is not None:
        if validation := joint.evidence.cross_validation:
            image = images_of([(partial(draw_unseen_run, validation, units[0]), _UNSEEN)])
            table = _prediction_table(validation, units[0])
            sections.append(PageSection(f"{name}Prediction of unseen runs", (table,), image))
        image = images_of([(partial(draw_friction, joint.evidence, units), _FRICTION)])
        sections.append(PageSection(f"{name}Friction", images=image))
    if joint.two_mass is not None:
        image = images_of([(partial(draw_starts, start, units), _STARTS) for start in joint.two_mass.starts])
        sections.append(PageSection(f"{name}Starts, elastic drive", images=image))
    if joint.controller is not None and joint.controller.comparison is not None:
        compared = joint.controller.comparison
        caption = "The identified controller driven by the logged references and speed, over the longest section."
        image = images_of([(partial(draw_controller, compared, units[0]), caption)])
        sections.append(PageSection(f"{name}Controller", images=image))
    return sections


_UNSEEN = "A run that was left out of the fit: a residual beyond the grey band is the model's error."
_FRICTION = (
    "Left: force minus that of the inertia, per interval of speed, and the model. Right: what the model leaves over "
    "along the travel. Bars are two standard errors between strokes, or blocks of the log."
)
_STARTS = (
    "The force of the model is the measured one with a weak correction towards the measured speed: what they differ by "
    "is not explained by the model."
)


def _prediction_table(validation: CrossValidation, force: str) -> Table:
    rows = [
        [Cell("identified model"), number_cell(validation.error)],
        [
            Cell(f"between equal motions ({validation.repeats}): no model can be better"),
            number_cell(validation.floor if validation.repeats else None),
        ],
    ]
    columns = (Heading("in motion"), Heading(f"RMS [{force}]", numeric=True))
    title = f"RMS error of the force in what was left out of the fit ({counted(validation.folds, 'part')} in turn)"
    return Table("prediction", title, columns, rows)


def _refused_table(joint: JointIdentification) -> Table:
    rows = [[Cell(method.replace("_", "-")), Cell(visible(reason))] for method, reason in joint.refused.items()]
    return Table("refused", "Methods that could not be used", (Heading("method"), Heading("reason")), rows)


def _robot_sections(done: IdentifiedMachine) -> list[PageSection]:
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
    rows = [(joint, joint.robot) for joint in robot.joints if joint.robot]
    fields = (
        (Heading("joint"), lambda item: name_cell(visible(item[0].joint))),
        (Heading("unit"), lambda item: Cell(item[0].units[1])),
        (Heading("torque, RMS", numeric=True), lambda item: number_cell(item[1].torque)),
        (Heading("old friction", numeric=True), lambda item: number_cell(item[1].before)),
        (Heading("new friction", numeric=True), lambda item: number_cell(item[1].after)),
        (
            Heading("used"),
            lambda item: Cell(words_of_decision(item[1]), tone="good" if item[1].answer is FrictionAnswer.NEW else ""),
        ),
    )
    title = "Torque that is not explained in what was left out of the fit, RMS"
    return PageSection("Friction of the joints", (tabulate("torque", title, fields, rows),))


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
