"""The machine that meets the obstacle: an axis, or a point of a robot's link; what both have for injection."""

from __future__ import annotations

from dataclasses import dataclass, replace

from cdtool.base.errors import ConfigurationError
from cdtool.commands.inject.assumption import Assumption
from cdtool.commands.inject.axis_contact import axis_contact
from cdtool.commands.inject.inject_section import InjectSection
from cdtool.commands.inject.injected_contact import InjectedContact
from cdtool.commands.inject.robot_contact import RobotLog, StruckPoint, least_known_joint, robot_contact
from cdtool.formats.channels.channel_assembly import LoggedRecording
from cdtool.formats.machine_file import MachineFile
from cdtool.machines.axis import Axis
from cdtool.machines.axis_model.axis_run import AxisRun, axis_run
from cdtool.machines.axis_model.model_table import axis_model
from cdtool.machines.axis_model.obstacle import Obstacle
from cdtool.machines.axis_model.parameters import AxisModel
from cdtool.machines.coupled import CoupledMachine
from cdtool.machines.robot_model.parameters import RobotModel, robot_model
from cdtool.recordings.recording import Recording


@dataclass(frozen=True)
class StruckAxis:
    """An axis that meets the obstacle with its load; `joint` is its index, `lever` [m] 0 for a linear axis."""

    model: AxisModel
    joint: int
    lever: float = 0.0

    @property
    def joints(self) -> tuple[int, ...]:
        """Return the joints whose channels change."""
        return (self.joint,)

    @property
    def deciding_model(self) -> AxisModel:
        """Return the model that decides which detectors can be tested, and what is assumed."""
        return self.model

    def read(self, recording: Recording, _logged: LoggedRecording) -> AxisRun:
        """Return the channels of an impact-free recording on the load side."""
        return axis_run(recording, self.joint)

    def contact(
        self, run: AxisRun, obstacle: Obstacle, time: float, duration: float, assumption: Assumption
    ) -> InjectedContact:
        """Return the contact at a time [s]; raises RecordingError if it cannot be.

        On a rotary axis the obstacle acts on a lever: torque = lever * force, deflection = lever * angle.
        """
        if not self.lever:
            return axis_contact(run, self.model, obstacle, time, duration, assumption)
        contact = axis_contact(run, self.model, obstacle.on_lever(self.lever), time, duration, assumption)
        force = replace(contact.force, values=contact.force.values / self.lever)
        return replace(contact, force=force, peak_force=contact.peak_force / self.lever)


@dataclass(frozen=True)
class StruckRobot:
    """A robot that meets the obstacle with a point of a link."""

    model: RobotModel
    point: StruckPoint

    @property
    def joints(self) -> tuple[int, ...]:
        """Return the joints whose channels change: all."""
        return tuple(range(len(self.model.joints)))

    @property
    def deciding_model(self) -> AxisModel:
        """Return the model that decides which detectors can be tested, and what is assumed: the least known joint."""
        return least_known_joint(self.model)

    def read(self, recording: Recording, logged: LoggedRecording) -> RobotLog:
        """Return the channels of an impact-free recording on the load side."""
        of_sensors = logged.recording.channels.get("acceleration")
        return RobotLog(
            tuple(axis_run(recording, joint) for joint in self.joints), of_sensors.unit if of_sensors else ""
        )

    def contact(
        self, run: RobotLog, obstacle: Obstacle, time: float, duration: float, assumption: Assumption
    ) -> InjectedContact:
        """Return the contact at a time [s]; raises RecordingError if it cannot be."""
        return robot_contact(run, self.model, self.point, obstacle, time, duration, assumption)


def struck_machine(section: InjectSection, machine_file: MachineFile) -> StruckAxis | StruckRobot:
    """Return the machine of a section [inject]; raises ConfigurationError for an incomplete model or unknown link."""
    machine = machine_file.machine
    if isinstance(machine, Axis):
        return StruckAxis(axis_model(machine, machine_file.model, section.joint), section.joint, section.lever)
    if isinstance(machine, CoupledMachine) and section.struck is not None:
        model = robot_model(machine, machine_file.model)
        model.link(section.struck.link)
        return StruckRobot(model, section.struck)
    raise ConfigurationError(
        f"{machine_file.path}: contacts cannot be injected into a {type(machine).__name__}",
        "use a linear_axis, rotary_axis, planar_arm or urdf_robot",
    )
