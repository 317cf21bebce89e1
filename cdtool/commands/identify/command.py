"""`cdtool identify`."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, TypeGuard

import typer

from cdtool.base.errors import UsageError
from cdtool.base.plain_text import counted
from cdtool.commands.console.console import (
    leave,
    number,
    plain,
    print_json,
    print_line,
    print_skipped,
    print_written,
    progress,
    say,
    table,
)
from cdtool.commands.console.options import ForceOption, JobsOption, JsonOption, QuietOption
from cdtool.commands.console.place import Place, location

if TYPE_CHECKING:
    from cdtool.commands.identify.axis.rigid_axis import RigidAxisFit
    from cdtool.commands.identify.identifying import IdentifiedMachine
    from cdtool.commands.identify.identifying_robot import RobotIdentification
    from cdtool.commands.identify.joint import JointIdentification
    from cdtool.commands.identify.robot.drive_gains import LoadedRuns
    from cdtool.execution.workers import Workers

_PAYLOAD = re.compile(r"(?P<mass>[^@:]+?) ?kg(?:@(?P<link>[^:]+))?(?::(?P<centre>.+))?")
_DOUBT = (
    "times what equal strokes differ by: a spring, a lag of the torque or friction along the travel is not in it, and "
    "its errors may be too small"
)


def identify(
    logs: Annotated[
        list[str], typer.Argument(help="Impact-free logs; patterns such as free/*.csv are allowed.", metavar="LOG")
    ],
    machine: Annotated[
        Place,
        typer.Option("--machine", "-m", parser=location, help="Machine file."),
    ],
    output: Annotated[
        list[Place] | None,
        typer.Option(
            "--output",
            "-o",
            parser=location,
            help="Output, repeatable: .toml (machine file: the same or a new one), .html, .json. Default: none.",
        ),
    ] = None,
    loaded_logs: Annotated[
        list[str] | None,
        typer.Option("--loaded-logs", help="Of a robot: logs with a known payload, for torque constants; repeatable."),
    ] = None,
    payload: Annotated[
        str | None,
        typer.Option("--payload", help="The payload of --loaded-logs: 3.2kg@LINK:X,Y,Z, with its centre of mass [m]."),
    ] = None,
    force: ForceOption = False,
    jobs: JobsOption = 1,
    quiet: QuietOption = False,
    as_json: JsonOption = False,
) -> None:
    """Identify the model of an axis or robot from impact-free logs, with honest standard errors.

    Of an axis: mass, drive, friction and controller. Of a robot: friction, inertias, torque constants.
    Every change of the machine file is shown; old values remain in its comments.

    Example: cdtool identify 'sample_logs/gate/free/*.csv' -m sample_logs/gate/machine.toml -o machine.toml
    """
    from cdtool.commands.identify.files import check_identification_files
    from cdtool.execution.workers import Workers

    targets = output or []
    check_identification_files(targets, machine, force=force)
    loaded = _loaded_runs(loaded_logs or (), payload)
    _identify_machine(logs, machine, targets, Workers(jobs), loaded, as_json=as_json, quiet=quiet)


def _loaded_runs(logs: Sequence[str], payload: str | None) -> LoadedRuns | None:
    """Return the runs with a payload; None without any. Raises UsageError for one without the other."""
    from cdtool.commands.identify.robot.drive_gains import LoadedRuns

    if bool(logs) != (payload is not None):
        raise UsageError("--loaded-logs and --payload belong together", "give both, or neither")
    if payload is None:
        return None
    found = _PAYLOAD.fullmatch(payload.strip())
    try:
        mass = float(found["mass"]) if found else math.nan
        centre = tuple(map(float, found["centre"].split(","))) if found and found["centre"] else None
    except ValueError:
        mass, centre = math.nan, None
    if found is None or not 0.0 < mass < math.inf or not _is_point(centre):
        hint = "give it as 3.2kg@hand:0,0,0.06; link and centre of mass [m] may be left out"
        raise UsageError(f"--payload is '{payload}'", hint)
    return LoadedRuns(tuple(logs), mass, found["link"] or "", centre)


def _is_point(centre: tuple[float, ...] | None) -> TypeGuard[tuple[float, float, float] | None]:
    return centre is None or (len(centre) == 3 and all(map(math.isfinite, centre)))


def _identify_machine(
    logs: Sequence[str],
    machine: Path,
    targets: Sequence[Path],
    workers: Workers,
    loaded: LoadedRuns | None,
    *,
    as_json: bool,
    quiet: bool,
) -> None:
    from cdtool.commands.identify.files import MACHINE, write_identification
    from cdtool.commands.identify.identifying import identify as run
    from cdtool.commands.judging.runs import find_logs

    with progress("identifying", quiet=quiet) as advance:
        done = run(logs, machine, workers=replace(workers, progress=advance), loaded=loaded)
    written = write_identification(done, targets, find_logs(logs, Path()))
    done = replace(done, written=", ".join(str(path) for path in written if path.suffix.lower() == MACHINE))
    print_skipped(done.skipped, done.findings)
    if as_json:
        print_json({**done.summary, "outputs": [str(path) for path in written]})
    else:
        _show(done, written, targets, quiet=quiet)
    leave(done.skipped)


def _show(done: IdentifiedMachine, written: Sequence[Path], targets: Sequence[Path], *, quiet: bool) -> None:
    from cdtool.commands.identify.words import words_of_robot

    runs = counted(len(done.runs), "impact-free run")
    print_line(f"{plain(done.machine)}: identified from {runs}")
    for joint in done.joints:
        validation = joint.evidence.cross_validation if joint.evidence else None
        # The error on unseen runs is three times the difference of equal strokes: something is not in the model.
        if validation and (left := validation.left_over) > 3.0:
            print_line(f"{plain(joint.joint)}: the model leaves over {number(left, 2)} {_DOUBT}")
    if done.changes and not quiet:
        _show_changes(done)
    if done.robot is not None and not quiet:
        _show_frictions(done.robot)
    for joint in done.joints:
        _show_joint(joint, f"{plain(joint.joint)}: " if len(done.joints) > 1 else "")
    for line in words_of_robot(done.robot, done.joints, len(done.runs)) if done.robot else ():
        print_line(plain(line))
    _show_files(done, written, targets)


def _show_joint(joint: JointIdentification, name: str) -> None:
    from cdtool.commands.identify.words import words_of_needs

    if joint.rigid is not None:
        _show_quality(joint, joint.rigid, name)
    for item in joint.not_identifiable:
        needs = words_of_needs(item.missing)
        print_line(f"{name}not identifiable: {item.section}.{item.key}{f': add {needs}' if needs else ''}")
    for method, reason in joint.refused.items():
        print_line(f"{name}not used: {method.replace('_', '-')}: {plain(reason)}")


def _show_files(done: IdentifiedMachine, written: Sequence[Path], targets: Sequence[Path]) -> None:
    print_written(written)
    for target in targets:
        if target not in written:
            print_line(f"not written: {plain(target)}: nothing new predicts unseen runs better")
    if not targets and done.changes:
        print_line("nothing is written: give -o machine.toml")


def _show_frictions(robot: RobotIdentification) -> None:
    from cdtool.commands.identify.words import words_of_decision

    rows = []
    for joint in robot.joints:
        friction = joint.robot
        assert friction is not None
        errors = [number(item) for item in (friction.torque, friction.before, friction.after)]
        rows.append([joint.joint, joint.units[1], *errors, words_of_decision(friction)])
    headings = ("torque", "old\nfriction", "new\nfriction")
    columns = [("joint", "left"), ("unit", "left"), *((heading, "right") for heading in headings), ("used", "left")]
    say("RMS of the torque, and of what the model leaves unexplained in parts that were left out of the fit:")
    table(columns, rows)


def _show_changes(done: IdentifiedMachine) -> None:
    from cdtool.commands.identify.machine_update import values_text

    rows = []
    for change in done.changes:
        texts = (values_text(change.old), values_text(change.values), values_text(change.standard_errors, 2))
        rows.append((f"{change.section}.{change.key}", *texts, change.unit))
    table([(heading, "left") for heading in ("key", "old", "new", "standard error", "unit")], rows)


def _show_quality(joint: JointIdentification, rigid: RigidAxisFit, name: str) -> None:
    if validation := rigid.evidence.cross_validation:
        floor = f", between equal strokes {number(validation.floor)}" if validation.repeats else ""
        print_line(f"{name}force on unseen runs: {number(validation.error)} {joint.units[1]} RMS while moving{floor}")
    for level in rigid.levels:
        way, speed = "forward" if level.direction > 0 else "backward", f"{number(level.speed)} {joint.units[2]}/s"
        force = f"{number(level.force, 4)} +- {number(level.standard_error, 2)} {joint.units[1]}"
        print_line(f"{name}friction {way} at {speed}: {force}")
