"""`cdtool identify`: parameters of a machine's model from its impact-free logs."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from datetime import date
from pathlib import Path
from typing import Any

import numpy as np

from cdtool.base.errors import CdtoolError, ConfigurationError, RecordingError, UsageError
from cdtool.base.files.bounded_loading import read_text, read_toml
from cdtool.base.files.writing import write_texts
from cdtool.base.plain_text import NAMED, counted
from cdtool.base.remote.remote_path import location
from cdtool.commands.identify.axis.rigid_axis import RigidAxisFit, RigidAxisSettings, identify_rigid_axis
from cdtool.commands.identify.axis.speed_controller import SIGNIFICANT, ControllerSettings, identify_controller
from cdtool.commands.identify.axis.two_mass import TwoMassSettings, identify_two_mass
from cdtool.commands.identify.estimate import IdentificationError
from cdtool.commands.identify.identifying_robot import RobotIdentification, identify_joints
from cdtool.commands.identify.joint import JointIdentification
from cdtool.commands.identify.machine_update import MachineChange, changes_of, robot_files, updated_text
from cdtool.commands.identify.robot.drive_gains import LoadedRuns
from cdtool.commands.identify.robot.friction_choice import FrictionForm
from cdtool.commands.judging.part_to_learn_from import PartToLearnFrom
from cdtool.commands.judging.runs import RunReading, Runs, find_logs, load_runs, several_logs
from cdtool.commands.judging.scoring_rules import ScoringRules
from cdtool.commands.judging.settings_table import GUARD
from cdtool.commands.judging.true_contacts import any_contacts
from cdtool.commands.scoring.benchmark_file import read_benchmark_file
from cdtool.execution.workers import Workers
from cdtool.formats.machine_file import MachineFile, read_machine_file
from cdtool.machines.axis_model.axis_run import AxisRun, axis_run
from cdtool.machines.axis_model.model_table import ModelTable
from cdtool.machines.axis_model.parameters import Sensors
from cdtool.machines.coupled import CoupledMachine
from cdtool.recordings.recording import Contact, Recording
from cdtool.results.results import RecordingFinding, Skipped
from cdtool.truth.onset_rule import OnsetRule

_COULOMB = ("coulomb_friction", "coulomb_forward", "coulomb_backward")


@dataclass(frozen=True, eq=False, repr=False)
class IdentifiedMachine:
    """The identification of a machine: by joint, the changes of its file, and the text of the updated file.

    `robot`: what belongs to all joints of a robot or planar arm. `source`: the machine file that was read.
    """

    machine: str
    joints: tuple[JointIdentification, ...]
    changes: tuple[MachineChange, ...]
    text: str
    runs: tuple[str, ...]
    skipped: tuple[Skipped, ...]
    findings: tuple[RecordingFinding, ...]
    written: str = ""
    robot: RobotIdentification | None = None
    source: Path | None = None

    def __repr__(self) -> str:
        return f"IdentifiedMachine({self.machine}, {counted(len(self.changes), 'change')})"

    def files_for(self, target: Path) -> tuple[tuple[Path, str], ...]:
        """Return the files of an updated machine file `target`, and their texts; none if nothing changes.

        That is the machine file, and for a robot with new inertias its URDF, under a name that does not exist yet.
        """
        if not self.changes:
            return ()
        if self.source is None or self.robot is None:
            return ((target, self.text),)
        return robot_files(self.text, self.robot.urdf, self.source, target)

    @property
    def summary(self) -> dict[str, Any]:
        """Return everything but the samples as JSON values."""
        return {
            "tool": "cdtool identify",
            "machine": self.machine,
            "runs": list(self.runs),
            "changes": [{**asdict(change), "method": change.method.value} for change in self.changes],
            "joints": [joint.summary for joint in self.joints],
            "skipped": [asdict(item) for item in self.skipped],
            "findings": [asdict(item) for item in self.findings],
            "written": self.written or None,
            "robot": self.robot.summary if self.robot else None,
        }


def identify(
    logs: Sequence[str | Path],
    machine: str | Path,
    output: str | Path | None = None,
    *,
    force: bool = False,
    workers: Workers | None = None,
    loaded: LoadedRuns | None = None,
) -> IdentifiedMachine:
    """Identify the parameters of a machine's model from impact-free logs, and update its machine file.

    Parameters
    ----------
    logs : sequence of str or Path
        Impact-free logs, and logs with a contact that the load cell shows: they are used up to 0.2 s before it. Or one
        benchmark file: what it learns from is used.
    machine : str or Path
        The machine file: the motor's inertia and what is known of the sensors are used.
    output : str or Path, optional
        The machine file to write; may be `machine` itself. Every value has its standard error and origin as a
        comment, and the old value. New inertias of a robot are written as a URDF beside it. A robot of which nothing
        new predicts unseen runs better is not written.
    force : bool, optional
        Overwrite an existing file other than `machine`.
    workers : Workers, optional
        How the logs are read.
    loaded : LoadedRuns, optional
        Of a robot: logs of motion with a known payload, which show the torque constants of its joints.

    Returns
    -------
    IdentifiedMachine
        What was identified with standard errors, what these logs cannot show, and the changes of the machine file.

    Raises
    ------
    IdentificationError
        Nothing can be identified from these logs; nothing is written.
    ConfigurationError
        The machine file is wrong.
    SignatureError
        No log is left.
    UsageError
        The output exists, or a payload is given for an axis.

    Examples
    --------
    >>> import cdtool
    >>> logs = ["sample_logs/gate/free/*.csv"]
    >>> done = cdtool.identify(logs, "sample_logs/gate/machine.toml", "identified.toml")
    >>> [change.key for change in done.changes][:2]
    ['load_mass', 'stiffness']
    """
    target = None if output is None else location(output)
    path = location(machine)
    if target is not None and target.exists() and not force and target.resolve() != path.resolve():
        raise UsageError(f"{target}: already exists", "choose another name, or overwrite it with --force")
    machine_file = read_machine_file(path)
    if loaded is not None and not isinstance(machine_file.machine, CoupledMachine):
        raise UsageError("a payload is given for an axis", "torque constants are identified of robots only")
    paths, reading = read_until(logs, workers)
    runs, recordings = _impact_free(paths, machine_file, reading)
    given = read_toml(path, "a machine file")
    robot = _identify_robot(machine_file, recordings, given, loaded, reading)
    if robot is not None:
        joints = robot.joints
    else:
        count = len(machine_file.machine.joints)
        joints = tuple(_identify_joint(machine_file, joint, recordings) for joint in range(count))
    estimates = [replace(item, joint=number) for number, joint in enumerate(joints) for item in joint.estimates]
    together = [replace(item, joint=number) for number, joint in enumerate(joints) for item in joint.together]
    if robot is not None and robot.gains is not None:
        estimates += robot.gains.estimates
    if not estimates and not together and not _was_compared(joints):
        raise IdentificationError(
            f"nothing can be identified from {counted(len(recordings), 'log')}: {'; '.join(_reasons(joints))}",
            "see docs/identification.md for the motion that is needed",
        )
    changes = changes_of(machine_file.machine, given, estimates, together)
    origin = f"{counted(len(recordings), 'run')}, {date.today().isoformat()}"
    text = updated_text(read_text(path, ConfigurationError), changes, origin)
    identified = IdentifiedMachine(
        machine_file.machine.name,
        joints,
        changes,
        text,
        tuple(recording.name for recording in recordings),
        runs.skipped,
        runs.findings,
        robot=robot,
        source=path,
    )
    files = identified.files_for(target) if target is not None else ()
    if not files:
        return identified
    write_texts(dict(files))
    return replace(identified, written=str(target))


def read_until(logs: Sequence[str | Path], workers: Workers | None = None) -> tuple[list[Path], RunReading]:
    """Return the paths of the logs and how they are read: each up to its first contact, if its load cell shows one.

    In place of logs one benchmark file may be given: its [learn] logs are read as `cdtool benchmark` reads them, with
    its labels, sections and `until`.
    """
    given = [location(item) for item in several_logs(logs)]
    if len(given) == 1 and given[0].suffix.lower() == ".toml":
        benchmark = read_benchmark_file(given[0])
        return list(benchmark.learn), replace(benchmark.run_reading(workers), operations="whole")
    reading = RunReading("whole", onset=OnsetRule(), part=_up_to_contact, workers=workers or Workers())
    return find_logs(map(str, logs), Path()), reading


def _up_to_contact(listed: Path, recording: Recording) -> tuple[Recording, Sequence[Contact]]:
    part = PartToLearnFrom(ScoringRules(), guard=GUARD)
    return part(listed, recording) if any_contacts(recording, part.rules) else (recording, ())


def _impact_free(paths: Sequence[Path], machine_file: MachineFile, reading: RunReading) -> tuple[Runs, list[Recording]]:
    """Return the runs of some logs, and their recordings; raises IdentificationError if none can be used."""
    runs = load_runs(paths, machine_file, reading)
    recordings = [operation.recording for operation in runs.operations]
    if not recordings:
        reason = runs.skipped[0].reason if runs.skipped else "no log is given"
        raise IdentificationError(f"no impact-free log is left: {reason}", "give other logs")
    for check in runs.ranges.all.contradicted:
        if check.numbers["found"] != "inertia":  # that of the machine file is what is to be identified
            raise IdentificationError(f"{machine_file.path}: {check}")
    return runs, recordings


def _identify_robot(
    machine_file: MachineFile,
    recordings: Sequence[Recording],
    given: Mapping[str, Any],
    payload: LoadedRuns | None,
    reading: RunReading,
) -> RobotIdentification | None:
    """Return what was identified of a robot; None for an axis."""
    machine = machine_file.machine
    if not isinstance(machine, CoupledMachine):
        return None
    loaded = None
    if payload is not None:
        paths, _ = read_until(payload.logs)
        loaded = _impact_free(paths, machine_file, reading)[1], payload
    return identify_joints(recordings, machine, given, machine_file.path.parent, loaded)


def _was_compared(joints: Sequence[JointIdentification]) -> bool:
    """Return whether the friction of a robot's joint was fitted, even if it predicts worse than the present one."""
    fitted = (FrictionForm.FRICTION, FrictionForm.FRICTION_ALONE)
    return any(form in joint.robot.errors for joint in joints if joint.robot for form in fitted)


def _reasons(joints: Sequence[JointIdentification]) -> list[str]:
    """Return why nothing was identified, each reason once: the motion that is too weak, not what a controller needs."""
    reasons = [text for joint in joints for name, text in joint.refused.items() if name != "controller"]
    missing = [item for joint in joints for item in joint.not_identifiable if item.section != "model.controller"]
    reasons += [f"{item.key} needs {', '.join(kind.value for kind in item.missing)}" for item in missing]
    return list(dict.fromkeys(reasons))[:NAMED]


def _identify_joint(machine_file: MachineFile, joint: int, recordings: Sequence[Recording]) -> JointIdentification:
    machine: Any = machine_file.machine
    name = machine.joints[joint]
    refused: dict[str, str] = {}
    runs: list[AxisRun] = []
    for recording in recordings:
        try:
            runs.append(axis_run(recording, joint))
        except RecordingError as fault:
            refused.setdefault("log", str(fault))
    if not runs:
        return JointIdentification(name, refused=refused)
    is_rotary = machine.force_unit != "N"
    motor_mass = float(machine.reflected_inertia[joint])
    table: ModelTable | None = machine_file.model
    if motor_mass == 0.0 and table is not None:
        motor_mass = table.of_joint("drive", joint).get("motor_mass", 0.0)
    stated = table.of_joint("sensors", joint) if table else {}
    sensors = Sensors(**stated)
    force, travel = ("N m", "rad") if is_rotary else ("N", "m")
    mass = "kg m2" if is_rotary else "kg"
    found: dict[str, Any] = {}
    methods: dict[str, Callable[[], Any]] = {
        "rigid": lambda: identify_rigid_axis(
            runs,
            motor_mass,
            RigidAxisSettings(units=(mass, force, travel), torque_filter_time=stated.get("torque_filter_time")),
        ),
        "two_mass": lambda: identify_two_mass(
            runs, TwoMassSettings(motor_mass=motor_mass, sensors=sensors, units=(mass, force, travel))
        ),
        "controller": lambda: identify_controller(
            runs,
            # A stated 0 is known: the torque is measured without a low-pass.
            ControllerSettings(torque_filter_time=stated.get("torque_filter_time"), units=(force, travel)),
        ),
    }
    for method, run_method in methods.items():
        try:
            if method == "two_mass":
                _refuse_constant_force(found.get("rigid"), force)
            found[method] = run_method()
        except CdtoolError as fault:
            refused[method] = str(fault)
        if method == "rigid" and _has_opposite_sign(found.get("rigid")):
            reason = "the torque falls where the acceleration rises: check the signs (scale) of torque and speed"
            return JointIdentification(name, refused={"sign": reason})
    units, rigid = (mass, force, travel, f"{force} s/{travel}"), found.get("rigid")
    return JointIdentification(
        name,
        units=units,
        evidence=rigid and rigid.evidence,
        excitation=rigid and rigid.excitation,
        has_torque_filter="torque_filter_time" in stated,
        refused=refused,
        **found,
    )


def _has_opposite_sign(fit: RigidAxisFit | None) -> bool:
    """Whether a negative total mass and negative friction are certain: torque or speed has the opposite sign."""
    numbers = {item.key: item.numbers for item in fit.identified.not_identifiable} if fit else {}
    signs = (("load_mass", "total_mass"), ("coulomb_friction", "value"))
    return all(
        numbers.get(key, {}).get(name, 0.0) < -SIGNIFICANT * numbers.get(key, {}).get("standard_error", math.inf)
        for key, name in signs
    )


def _refuse_constant_force(fit: RigidAxisFit | None, unit: str) -> None:
    """Raise IdentificationError where a constant force acts: the elastic drive has none, and would bend to fit it."""
    if fit is None or "constant_force" not in fit.identified:
        return
    constant = fit.identified["constant_force"]
    friction = [item.value for item in fit.identified.estimates if item.key in _COULOMB]
    known = abs(constant.value) > SIGNIFICANT * constant.standard_error
    # Above a fifth of the Coulomb friction the model of the starts cannot leave it out.
    if known and friction and abs(constant.value) > 0.2 * float(np.mean(friction)):
        raise IdentificationError(
            f"a constant force of {constant.value:.3g} {unit} acts, which the elastic drive's model does not have",
            "a vertical axis or one with a spring or counterweight: state [model.drive] stiffness from its data sheet",
        )
