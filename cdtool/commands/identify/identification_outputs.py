"""What the outputs of `cdtool identify` show beside the values: predictions of unseen runs, misfit, and a plan.

The runs are read again: an identification keeps no samples.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.errors import CdtoolError, RecordingError
from cdtool.commands.identify.axis.excitation import PlannedMotion, plan_motions
from cdtool.commands.identify.axis.rigid_axis import RigidAxisFit, identify_rigid_axis, low_passed_force, predict_force
from cdtool.commands.identify.axis.speed_controller import ControllerFit
from cdtool.commands.identify.axis.speed_controller_kernel import PARAMETER_ORDER, simulate_controller
from cdtool.commands.identify.axis.start_ensemble import StartEnsemble
from cdtool.commands.identify.axis.two_mass import TwoMassFit
from cdtool.commands.identify.contact.identifying_contacts import scaled
from cdtool.commands.identify.estimate import Missing, NotIdentifiable
from cdtool.commands.identify.identifying import IdentifiedMachine, JointIdentification, read_until
from cdtool.commands.identify.robot.robot_evidence import (
    FrictionDecision,
    RobotJointEvidence,
    decision_of,
    excitation_needs,
    inertia_plan,
    robot_evidence,
)
from cdtool.commands.identify.robot.robot_excitation import JointMotion, PlannedRobotMotion
from cdtool.commands.identify.robot.robot_run import RobotRun, robot_run
from cdtool.commands.judging.runs import load_runs
from cdtool.execution.workers import Workers
from cdtool.formats.machine_file import MachineFile, read_machine_file
from cdtool.machines.axis_model.axis_run import AxisRun, axis_run
from cdtool.machines.axis_model.parameters import AxisModel, Controller
from cdtool.machines.axis_model.sensor_filters import second_order_low_pass
from cdtool.machines.axis_model.simulation import AxisInputs, simulate_axis
from cdtool.machines.coupled import CoupledMachine
from cdtool.recordings.recording import Recording

# Of a single run this share of its moving time, the last one, is left out of the fit and predicted [-].
_LEFT_OUT = 0.3
# A motor's inertia below this share of the total is not given [-].
_NO_MASS = 1e-9
# A sample moves above this share of the highest speed.
_MOVING_SHARE = 0.05
# A weak correction towards the measured speed keeps the driven model from drifting: total mass times this [1/s].
_CORRECTION_RATE = 10.0
# The controller's filters have settled after so many samples; its integral at the start is the mean over so many more
# of what is left over, or that over the whole section of a controller without integral: a constant offset.
_SETTLING_SAMPLES, _INTEGRAL_SAMPLES = 20, 50


@dataclass(frozen=True, eq=False)
class UnseenRun:
    """The force on a run, or the last part of the only run, that was left out of the fit.

    `measured`, `predicted` (n,) [N, N m]: through one low-pass; NaN where there is no prediction, and where the sample
    was part of the fit. `moving` (n,). `of_runs`: the number of runs it is the worst of; 1 for a part of a single run.
    """

    run: str
    time: FloatArray
    measured: FloatArray
    predicted: FloatArray
    moving: BoolArray
    of_runs: int

    @property
    def residual(self) -> FloatArray:
        """Return measured minus predicted force (n,) [N, N m]."""
        return self.measured - self.predicted

    @property
    def moving_error(self) -> float:
        """Return the root mean square of the residual while moving [N, N m]; NaN without a prediction there."""
        residual = self.residual[self.moving & np.isfinite(self.residual)]
        return float(np.sqrt(np.mean(residual**2))) if len(residual) else math.nan


@dataclass(frozen=True, eq=False)
class StartComparison:
    """Aligned starts against the two-mass model that is driven by their mean force; arrays (n,) per channel.

    `time` [s] from the start of the motion. `deviation`: from run to run. `modelled` includes the friction along the
    travel where it is known.
    """

    time: FloatArray
    count: int
    direction: int
    nominal_speed: float
    measured: Mapping[str, FloatArray]
    deviation: Mapping[str, FloatArray]
    modelled: Mapping[str, FloatArray]


@dataclass(frozen=True, eq=False)
class ControllerComparison:
    """The logged command, or the measured force (`is_command` False), and the identified controller's (n,) [N, N m]."""

    run: str
    time: FloatArray
    measured: FloatArray
    computed: FloatArray
    is_command: bool


@dataclass(frozen=True, eq=False)
class JointEvidence:
    """How well what was identified of a joint describes its logs; None or empty for what was not identified."""

    joint: str
    unseen: UnseenRun | None = None
    starts: tuple[StartComparison, ...] = ()
    controller: ControllerComparison | None = None
    plan: tuple[PlannedMotion, ...] = field(default=())
    robot: RobotJointEvidence | None = None


def plan_of(joint: JointIdentification, motion: JointMotion | None = None) -> tuple[PlannedMotion, ...]:
    """Return the motions that would make the other parameters of a joint identifiable; empty if nothing is missing.

    `motion`: of a robot's joint; an axis has the excitation of its fit.
    """
    if motion is not None:
        return plan_motions(joint.not_identifiable, motion.excitation)
    rate = math.nan
    if joint.two_mass is not None:
        rate = 1.0 / joint.two_mass.ensembles[0].period
    elif joint.controller is not None and joint.controller.controller is not None:
        rate = 1.0 / joint.controller.controller.period
    items = (*joint.not_identifiable, *_needs_of_the_drive(joint))
    return plan_motions(items, joint.rigid.excitation if joint.rigid else None, rate)


def _needs_of_the_drive(joint: JointIdentification) -> tuple[NotIdentifiable, ...]:
    """Return the motor's inertia if the stiffness of a drive was not identified because it is not given.

    It is what the rigid axis has more than its load. Another refusal, as of a fit that ends at a bound, needs no other
    motion: its own text says what to do.
    """
    if joint.rigid is None or joint.two_mass is not None or "two_mass" not in joint.refused:
        return ()
    identified = joint.rigid.identified
    if "load_mass" not in identified:
        return ()
    motor = joint.rigid.total_mass - identified["load_mass"].value
    if motor > _NO_MASS * joint.rigid.total_mass:
        return ()
    return (NotIdentifiable("model.drive", "stiffness", (Missing.MOTOR_INERTIA,)),)


def evidence_of(
    done: IdentifiedMachine, logs: Sequence[str | Path], machine: str | Path, workers: Workers | None = None
) -> tuple[JointEvidence, ...]:
    """Return per joint what the plots of the report show; reads the logs that were used again.

    Raises CdtoolError if the logs or the machine file cannot be read again.
    """
    modelled = any(joint.rigid or joint.two_mass or joint.controller for joint in done.joints)
    if not modelled and done.robot is None:
        return tuple(JointEvidence(joint.joint, plan=plan_of(joint)) for joint in done.joints)
    machine_file = read_machine_file(machine)
    used = _used_recordings(done, logs, machine_file, workers)
    if isinstance(machine_file.machine, CoupledMachine):
        return _robot_joints(done, used, machine_file.machine)
    evidence = []
    for number, joint in enumerate(done.joints):
        runs = []
        for recording in used:
            as_identified = scaled(recording, joint.torque_scale.factor, number) if joint.torque_scale else recording
            try:
                runs.append(axis_run(as_identified, number))
            except RecordingError:  # it was left out of the identification too
                continue
        evidence.append(_joint_evidence(joint, number, runs, machine_file))
    return tuple(evidence)


def _used_recordings(
    done: IdentifiedMachine, logs: Sequence[str | Path], machine_file: MachineFile, workers: Workers | None
) -> list[Recording]:
    paths, reading = read_until(logs, "LOGS", workers)
    operations = load_runs(paths, machine_file, reading).operations
    return [operation.recording for operation in operations if operation.recording.name in done.runs]


def _robot_joints(
    done: IdentifiedMachine, recordings: Sequence[Recording], machine: CoupledMachine
) -> tuple[JointEvidence, ...]:
    runs: list[RobotRun] = []
    for recording in recordings:
        try:
            runs.append(robot_run(recording))
        except RecordingError:  # it was left out of the identification too
            continue
    shown = robot_evidence(done, runs, machine)
    return tuple(
        JointEvidence(joint.joint, plan=plan_of(joint, item.motion), robot=item)
        for joint, item in zip(done.joints, shown, strict=True)
    )


def _joint_evidence(
    joint: JointIdentification, number: int, runs: Sequence[AxisRun], machine_file: MachineFile
) -> JointEvidence:
    if not runs:
        return JointEvidence(joint.joint, plan=plan_of(joint))
    table = machine_file.model.of_joint("sensors", number) if machine_file.model else {}
    known_accelerometer = table.get("accelerometer_hz", 0.0) > 0.0
    return JointEvidence(
        joint.joint,
        None if joint.rigid is None else predict_unseen(joint.rigid, runs),
        () if joint.two_mass is None else compare_starts(joint.two_mass, known_accelerometer),
        None if joint.controller is None else compare_controller(joint.controller, runs),
        plan_of(joint),
    )


def predict_unseen(fit: RigidAxisFit, runs: Sequence[AxisRun]) -> UnseenRun | None:
    """Return the prediction of the run that the fit describes worst, from a fit to the other runs.

    Of a single run the last 30 % of the moving time are predicted from the rest. None where the rest cannot be fitted.
    """
    form = fit.cross_validation.best if fit.cross_validation else None
    settings = replace(fit.settings, cross_validate=False, prediction=form)
    squares = np.zeros(len(runs))
    np.add.at(squares, fit.residuals.run, fit.residuals.residual**2)
    counts = np.bincount(fit.residuals.run, minlength=len(runs))
    worst = int(np.argmax(squares / np.maximum(counts, 1)))
    run = runs[worst]
    unseen = np.ones(len(run), dtype=np.bool_)
    if len(runs) > 1:
        others = [item for number, item in enumerate(runs) if number != worst]
    else:
        unseen = _last_part(run)
        others = [replace(run, torque=np.where(unseen, np.nan, run.torque))]
    try:
        without = identify_rigid_axis(others, 0.0, settings)
        predicted, measured = predict_force(without, run), low_passed_force(without, run)
    except CdtoolError:
        return None
    speed = np.abs(_speed(run))
    moving = unseen & (speed > _MOVING_SHARE * float(np.nanquantile(speed, 0.99)))
    nothing = np.full(len(run), np.nan)
    return UnseenRun(
        run.name,
        run.time - run.start,
        np.where(unseen, measured, nothing),
        np.where(unseen, predicted, nothing),
        moving,
        len(runs),
    )


def _speed(run: AxisRun) -> FloatArray:
    """Return the measured speed (n,), or the averaged derivative of the position."""
    if run.speed is not None:
        return run.speed
    assert run.position is not None
    width = max(round(0.02 / run.period), 1)
    rate = np.gradient(run.position, run.period)
    return np.convolve(rate, np.full(width, 1.0 / width), mode="same")


def _last_part(run: AxisRun) -> BoolArray:
    speed = np.nan_to_num(np.abs(_speed(run)))
    travelled = np.cumsum(speed > _MOVING_SHARE * float(np.max(speed, initial=0.0)))
    last: BoolArray = travelled > (1.0 - _LEFT_OUT) * travelled[-1]
    return last


def compare_starts(fit: TwoMassFit, known_accelerometer: bool = False) -> tuple[StartComparison, ...]:
    """Return each ensemble of starts against the identified two-mass model, driven by the mean force.

    The friction along the travel is added where the settled motion shows it. The model is corrected weakly towards the
    measured speed, as in the fit; its `torque` is the measured force with that correction: what they differ by is the
    force that the model does not explain. The acceleration is compared if the accelerometer's low-pass is known.
    """
    compared = []
    for ensemble, profile in zip(fit.ensembles, fit.profiles, strict=True):
        travelled = ensemble.direction * np.cumsum(ensemble.mean["speed"]) * ensemble.period
        inputs = AxisInputs(
            ensemble.mean["speed"],
            command=ensemble.mean["torque"],
            feed_forward=True,
            disturbance=-ensemble.direction * (profile.shares @ profile.at(travelled)),
        )
        gain = _CORRECTION_RATE * fit.model.drive.total_mass
        correction = Controller(period=ensemble.period, speed_gain=gain, speed_filter_order=0)
        motion = simulate_axis(replace(fit.model, controller=correction), inputs)
        modelled = {
            "speed": motion["motor_speed"],
            "torque": motion["command"],
            "position": motion["motor_position"],
        }
        if known_accelerometer:
            modelled["acceleration"] = _as_measured(fit.model, motion["load_acceleration"], ensemble)
        names = [name for name in modelled if name in ensemble.mean]
        compared.append(
            StartComparison(
                ensemble.period * (np.arange(len(ensemble), dtype=np.float64) - ensemble.start_index),
                ensemble.count,
                ensemble.direction,
                ensemble.nominal_speed,
                {name: ensemble.mean[name] for name in names},
                {name: ensemble.deviation[name] for name in names},
                {name: modelled[name] for name in names},
            )
        )
    return tuple(compared)


def _as_measured(model: AxisModel, acceleration: FloatArray, ensemble: StartEnsemble) -> FloatArray:
    sensors = model.sensors
    return second_order_low_pass(acceleration, sensors.accelerometer_hz, sensors.accelerometer_damping, ensemble.period)


def compare_controller(fit: ControllerFit, runs: Sequence[AxisRun]) -> ControllerComparison | None:
    """Return the command of the identified controller along the first usable run, beside the logged one.

    The controller is simulated with the logged references and speed, in open loop. Its integral at the start is not
    logged: it is set so that the first samples agree. None where the references or the gains are not known.
    """
    controller = fit.controller
    if controller is None:
        return None
    output = "reference_torque" if fit.is_command else "torque"
    needed = [output, "position" if fit.speed_from_position else "speed"]
    if controller.position_gain > 0.0:
        needed += ["position", "reference_position"]
    for run in runs:
        demand = _demand(fit, controller, run)
        if demand is None or any(getattr(run, name) is None for name in needed):
            continue
        part = _longest(run.known(*needed) & np.isfinite(demand))
        if part.stop - part.start > 2 * (_SETTLING_SAMPLES + _INTEGRAL_SAMPLES):
            measured = getattr(run, output)[part]
            computed = _computed(fit, controller, run, demand, part)
            time = run.time[part] - run.start
            settled = slice(_SETTLING_SAMPLES, None)
            return ControllerComparison(run.name, time[settled], measured[settled], computed[settled], fit.is_command)
    return None


def _demand(fit: ControllerFit, controller: Controller, run: AxisRun) -> FloatArray | None:
    """Return the speed reference (n,) that the controller follows, without the position loop; None without any."""
    demand: FloatArray | None = run.reference_speed
    follows_position = controller.position_gain > 0.0 or fit.speed_feed_forward
    if run.reference_position is None or not follows_position:
        return demand
    if demand is None:
        demand = np.zeros(len(run))
    if fit.speed_feed_forward:
        demand = demand + np.diff(run.reference_position, prepend=run.reference_position[:1]) / run.period
    return demand


def _longest(known: BoolArray) -> slice:
    """Return the longest uninterrupted section of known samples."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], known, [False])).astype(np.int8)))
    if not len(edges):
        return slice(0, 0)
    longest = int(np.argmax(edges[1::2] - edges[::2]))
    return slice(int(edges[2 * longest]), int(edges[2 * longest + 1]))


def _computed(fit: ControllerFit, controller: Controller, run: AxisRun, demand: FloatArray, part: slice) -> FloatArray:
    count = part.stop - part.start
    inputs = np.zeros((3, count))
    inputs[0] = demand[part]
    if controller.position_gain > 0.0 and run.position is not None and run.reference_position is not None:
        inputs[1] = (run.reference_position - run.position)[part]
    if fit.speed_from_position and run.position is not None:
        inputs[2] = (np.diff(run.position, prepend=run.position[:1]) / run.period)[part]
    elif run.speed is not None:
        inputs[2] = run.speed[part]
    values = asdict(controller) | {
        "period": run.period,
        "speed_filter_order": controller.speed_filter_order if fit.speed_from_position else 0,
        "error_offset": 0.0,
        "lag": 0.0 if fit.is_command or not math.isfinite(fit.lag) else fit.lag,
        "delay_samples": fit.delay_samples,
        "substeps": 1.0,
    }
    numbers = tuple(float(values[name]) for name in PARAMETER_ORDER)
    starts = np.array([0, count], dtype=np.int64)
    output = np.empty(count)
    target = run.reference_torque if fit.is_command else run.torque
    assert target is not None
    measured = target[part]
    first = np.full(1, measured[0] if fit.is_command else np.nan)
    simulate_controller(numbers, starts, np.zeros(1), np.full(1, np.nan), inputs, output)
    end = _SETTLING_SAMPLES + _INTEGRAL_SAMPLES if controller.integral_gain > 0.0 else count
    integral = np.array([float(np.mean((measured - output)[_SETTLING_SAMPLES:end]))])
    simulate_controller(numbers, starts, integral, first, inputs, output)
    return output


def identification_summary(
    done: IdentifiedMachine, evidence: Sequence[JointEvidence] = (), written: Sequence[Path] = ()
) -> dict[str, Any]:
    """Return everything that was identified as JSON values, with the plan, and what was written."""
    summary = done.summary
    for number, joint in enumerate(done.joints):
        plans = evidence[number].plan if evidence else plan_of(joint)
        values: dict[str, Any] = {"plan": [{**asdict(plan), "missing": plan.missing.name.lower()} for plan in plans]}
        if joint.rigid is not None:
            values["excitation"] = asdict(joint.rigid.excitation)
            values["condition_number"] = joint.rigid.condition_number
        unseen = evidence[number].unseen if evidence else None
        if unseen is not None:
            values["unseen_run"] = {"run": unseen.run, "moving_error": unseen.moving_error, "of_runs": unseen.of_runs}
        decision = decision_of(done, number)
        if decision is not None:
            values["friction_decision"] = _decision_summary(decision)
        robot = evidence[number].robot if evidence else None
        if robot is not None:
            values["unseen_run"] = robot.unseen and robot.unseen.summary
            values["motion"] = {
                **asdict(robot.motion),
                "missing": [m.name.lower() for m in excitation_needs(robot.motion)],
            }
        summary["joints"][number] |= values
    demanded = robot_plan_of(done, evidence)
    summary["inertia_plan"] = demanded and asdict(demanded)
    summary["outputs"] = [str(path) for path in written]
    return {"tool": "cdtool identify", **summary}


def _decision_summary(decision: FrictionDecision) -> dict[str, Any]:
    return {
        **asdict(decision),
        "answer": decision.answer.name.lower(),
        "form": decision.form.name.lower() if decision.form else None,
    }


def robot_plan_of(done: IdentifiedMachine, evidence: Sequence[JointEvidence]) -> PlannedRobotMotion | None:
    """Return the motion that would show the inertias of a robot's links; None if nothing is missing, or for an axis."""
    return inertia_plan(done, [item.robot.motion for item in evidence if item.robot is not None])
