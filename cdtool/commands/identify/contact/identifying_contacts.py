"""What contacts with a load cell add to an axis: its drive beyond the starts, its load, the scale of its torque."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from cdtool.base.errors import CdtoolError, ConfigurationError, RecordingError, UsageError
from cdtool.commands.identify.axis.speed_controller import ControllerFit
from cdtool.commands.identify.axis.torque_constant import TorqueScale, identify_torque_scale
from cdtool.commands.identify.axis.two_mass import TwoMassFit
from cdtool.commands.identify.contact.contact_fit import ContactFit, ContactSettings, identify_contacts
from cdtool.commands.identify.contact.load_cell_contact import load_cell_contact
from cdtool.commands.identify.estimate import Estimate, IdentificationError, Method
from cdtool.commands.identify.identifying_robot import torque_table
from cdtool.commands.judging.runs import find_logs, unread
from cdtool.formats.channels.reading import read_as_logged
from cdtool.formats.machine_file import MachineFile
from cdtool.machines.axis_model.model_table import ModelTable
from cdtool.machines.axis_model.parameters import AxisModel, ElasticDrive, Sensors
from cdtool.recordings.recording import Contact, Recording
from cdtool.results.results import Skipped
from cdtool.truth.onset import find_contacts
from cdtool.truth.onset_rule import OnsetRule

# Relative standard error of a stiffness that the impact-free logs show only together with others.
_UNCERTAIN = 0.3
# Channels in the unit of the torque.
_TORQUES = ("torque", "reference_torque")


@dataclass(frozen=True)
class ContactLogs:
    """Logs of an axis that hits (`struck`) and presses (`pressed`) a load cell.

    `struck`: stiff contacts, which show the drive beyond its starts. `pressed`: slow press and release, which show the
    scale of the torque. `lever_arm` [m]: of a rotary axis, from its axis to the load cell.
    """

    struck: tuple[str, ...] = ()
    pressed: tuple[str, ...] = ()
    lever_arm: float | None = None


@dataclass(frozen=True, eq=False)
class LoadCellLogs:
    """The recordings on the load side with their first contact, and the logs that were left out."""

    struck: tuple[tuple[Recording, Contact], ...] = ()
    pressed: tuple[tuple[Recording, Contact], ...] = ()
    skipped: tuple[Skipped, ...] = ()
    lever_arm: float = 1.0


def read_contacts(logs: ContactLogs, machine_file: MachineFile) -> LoadCellLogs:
    """Read logs with contacts; one that cannot be read or in which the load cell shows no contact is left out.

    Raises UsageError for a rotary axis without a lever arm.
    """
    machine: Any = machine_file.machine
    is_rotary = machine.force_unit != "N"
    if is_rotary and logs.lever_arm is None:
        raise UsageError("a rotary axis needs the lever arm of its load cell", "give it in m")
    found: dict[str, list[tuple[Recording, Contact]]] = {"contacts": [], "presses": []}
    skipped = []
    for key, patterns in (("contacts", logs.struck), ("presses", logs.pressed)):
        for path in find_logs(patterns, Path(), key) if patterns else ():
            try:
                found[key].append(_with_contact(path, machine_file))
            except CdtoolError as fault:
                skipped.append(unread(path, Path(), fault))
    lever = logs.lever_arm if is_rotary and logs.lever_arm is not None else 1.0
    return LoadCellLogs(tuple(found["contacts"]), tuple(found["presses"]), tuple(skipped), lever)


def _with_contact(path: Path, machine_file: MachineFile) -> tuple[Recording, Contact]:
    recording = replace(read_as_logged(path, machine_file).on_load_side(machine_file.machine), name=str(path))
    contacts = find_contacts(recording, OnsetRule())
    if not contacts:
        raise RecordingError(f"{path}: the load cell shows no contact", "give logs of contacts with a load cell")
    return recording, contacts[0]


def torque_scale(logs: LoadCellLogs, total_mass: float, joint: int) -> TorqueScale | None:
    """Return the factor of the torque's scale; None without presses. Raises IdentificationError if it is not known."""
    if not logs.pressed:
        return None
    return identify_torque_scale(logs.pressed, total_mass, joint, logs.lever_arm)


def scaled(recording: Recording, factor: float, joint: int) -> Recording:
    """Return a recording whose torque and torque reference of one joint are multiplied by a factor."""
    channels = dict(recording.channels)
    for name in _TORQUES:
        if name in channels:
            factors = [factor if column == joint else 1.0 for column in range(channels[name].joint_count)]
            channels[name] = channels[name].with_values(channels[name].values * factors, channels[name].unit)
    return replace(recording, channels=channels, digest="")


def scale_estimates(found: TorqueScale, given: Mapping[str, Any], joint: int) -> list[Estimate]:
    """Return the new scales of torque and torque reference as estimates of their tables in the machine file.

    Raises ConfigurationError where the torque is mapped for several formats: which of them has the wrong scale is not
    known.
    """
    section = torque_table(given).rpartition(".")[0]
    channels: Any = given
    for name in section.split("."):
        channels = channels[name]
    estimates = []
    for name in _TORQUES:
        table = channels.get(name)
        if isinstance(table, dict):
            present = table.get("scale", 1.0)
            value = float(present[joint] if isinstance(present, list) else present)
            error = abs(value) * found.standard_error
            estimates.append(
                Estimate(f"{section}.{name}", "scale", value * found.factor, error, "", Method.CONTACTS, joint)
            )
        elif name == "torque":
            raise ConfigurationError(
                "torque is mapped by a name alone", 'write torque = { column = "...", unit = "..." }, which has a scale'
            )
    return estimates


def identify_struck(
    logs: LoadCellLogs,
    machine_file: MachineFile,
    joint: int,
    fits: tuple[TwoMassFit, ControllerFit | None],
    units: tuple[str, str, str],
) -> ContactFit:
    """Return what the contacts show of the drive whose starts were identified.

    The front's stiffness and the sensors come from the machine file, the speed's low-pass from the controller. Raises
    IdentificationError where no contact can be used, with the reason of the first.
    """
    two_mass, controller = fits
    table = machine_file.model or ModelTable({})
    stated = table.of_joint("drive", joint)
    drive = ElasticDrive(
        motor_mass=two_mass.model.drive.motor_mass,
        load_mass=two_mass.model.drive.load_mass,
        stiffness=two_mass.model.drive.stiffness,
        damping=two_mass.model.drive.damping,
        front_stiffness=stated.get("front_stiffness", math.inf),
        motor_friction=stated.get("motor_friction", 0.0),
    )
    model = AxisModel(
        drive=drive,
        friction=two_mass.model.friction,
        controller=controller.controller if controller else None,
        sensors=Sensors(**table.of_joint("sensors", joint)),
    )
    contacts, reasons = [], []
    for recording, contact in logs.struck:
        try:
            contacts.append(load_cell_contact(recording, contact, model, joint, logs.lever_arm))
        except RecordingError as fault:
            reasons.append(str(fault))
    if not contacts:
        raise IdentificationError(
            f"no contact can be used: {reasons[0] if reasons else 'no log is left'}", "give other contacts"
        )
    error = two_mass.identified["stiffness"].relative_error if "stiffness" in two_mass.identified else _UNCERTAIN
    settings = ContactSettings(largest_wind_up=two_mass.largest_wind_up, stiffness_error=error, units=units)
    return identify_contacts(contacts, model, settings)
