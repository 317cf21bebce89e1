"""Write identified parameters into the text of a machine file: values, standard errors and origin, old values kept."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cdtool.base.plain_text import digits
from cdtool.base.remote.remote_path import joined, relative_name
from cdtool.base.toml_text import opened_table
from cdtool.commands.identify.estimate import Estimate, Method
from cdtool.machines.dynamics import Machine
from cdtool.machines.joint_machine import JointMachine
from cdtool.machines.urdf_robot import UrdfRobot

# Keys of whole numbers.
_WHOLE = ("speed_filter_order",)
# Digits of a written value, unless its standard error needs more: nobody measures a machine more exactly.
_DIGITS = 6


@dataclass(frozen=True)
class MachineChange:
    """A value of the machine file: the key's table, name, old values (None where it was not given) and new ones.

    `values`, `standard_errors` in `unit` as the file has them: friction of [machine] at the motor in motor coordinates.
    One per joint; a joint without a new value keeps the old one. A value that is not `is_known_alone` belongs to the
    other values of its table: together they describe the logs.
    """

    section: str
    key: str
    old: tuple[float | None, ...]
    values: tuple[float, ...]
    standard_errors: tuple[float, ...]
    unit: str
    method: Method
    is_known_alone: bool = True


def changes_of(
    machine: Machine, given: Mapping[str, Any], estimates: Sequence[Estimate], together: Sequence[Estimate] = ()
) -> tuple[MachineChange, ...]:
    """Return the changes to a machine file with the values `given` that the estimates make, in their order.

    The estimates `together` are not identifiable alone; a key of which one joint has such a value is one of them.
    """
    joints = len(machine.joints)
    grouped: dict[tuple[str, str], dict[int, Estimate]] = {}
    for estimate in (*estimates, *together):
        grouped.setdefault((estimate.section, estimate.key), {}).setdefault(estimate.joint, estimate)
    not_alone = {(estimate.section, estimate.key) for estimate in together}
    changes = []
    for (section, name), by_joint in grouped.items():
        first = next(iter(by_joint.values()))
        key, unit, factors = _as_in_file(machine, first)
        old = _old_values(given, section, key, joints)
        values, errors = [], []
        for joint in range(joints):
            estimate_here = by_joint.get(joint)
            factor = factors[joint]
            error = math.nan if estimate_here is None else estimate_here.standard_error * abs(factor)
            kept = old[joint] or 0.0
            values.append(kept if estimate_here is None else _rounded(estimate_here.value * factor, error))
            errors.append(error)
        alone = (section, name) not in not_alone
        changes.append(MachineChange(section, key, old, tuple(values), tuple(errors), unit, first.method, alone))
    return tuple(changes)


def updated_text(text: str, changes: Sequence[MachineChange], origin: str) -> str:
    """Return the text of a machine file with the changes, each with a comment; everything else is kept.

    `origin` states the logs and the day, for example "14 runs, 2026-11-27".
    """
    import tomlkit

    document = tomlkit.parse(text)
    for change in changes:
        table = opened_table(document, *change.section.split("."))
        value: Any = change.values[0] if len(set(change.values)) == 1 else list(change.values)
        before = table.get(change.key)
        item = tomlkit.item(int(value) if change.key in _WHOLE else value)
        item.comment(_comment(change, before, origin))
        table[change.key] = item
    return tomlkit.dumps(document)


def robot_files(text: str, urdf: str, source: Path, target: Path) -> tuple[tuple[Path, str], ...]:
    """Return the updated machine file of a robot at `target` and its URDF, each with its text.

    `text` of the machine file `source` with its changes; `urdf`: the text of the updated URDF, empty if it stays. The
    new URDF is named after the target, with a number if that file exists: no URDF is overwritten. One that stays is
    named from the folder of the target.
    """
    import tomlkit

    document = tomlkit.parse(text)
    table: Any = document["machine"]
    if "urdf" not in table:
        return ((target, text),)
    before = str(table["urdf"])
    if not urdf:
        if target.absolute().parent != source.absolute().parent:
            table["urdf"] = relative_name(joined(source.parent, before), target.parent)
        return ((target, tomlkit.dumps(document)),)
    names = (target.with_name(f"{target.stem}{part}.urdf") for part in ("", *(f"_{i}" for i in range(2, 10_000))))
    name = next(path for path in names if not path.exists())
    item = tomlkit.item(name.name)
    item.comment(f"identified inertias; was {before}")
    table["urdf"] = item
    return ((target, tomlkit.dumps(document)), (name, urdf))


def _comment(change: MachineChange, before: Any, origin: str) -> str:
    errors = values_text(change.standard_errors, 2)
    spread = f"[{errors}]" if "," in errors else errors
    parts = [f"+- {spread} {change.unit}" if spread != "-" else change.unit, change.method.value, origin]
    was = ""
    if before is not None:
        earlier = before.trivia.comment.strip("# ") if hasattr(before, "trivia") else ""
        plain = before.unwrap() if hasattr(before, "unwrap") else before
        was = f"; was {plain}" + (f" ({earlier})" if earlier else "")
    if not change.is_known_alone:
        parts.append("valid only together with the other values of this table")
    return ", ".join(part for part in parts if part) + was


def _rounded(value: float, error: float) -> float:
    """Return a value with one digit more than its standard error has, and at least six."""
    if not math.isfinite(error) or error <= 0.0 or value == 0.0:
        return float(f"{value:.{_DIGITS}g}")
    # One digit beyond the first digit of its standard error.
    needed = math.ceil(math.log10(abs(value) / error)) + 2
    return float(f"{value:.{max(needed, _DIGITS)}g}")


def _old_values(given: Mapping[str, Any], section: str, key: str, joints: int) -> tuple[float | None, ...]:
    table: Any = given
    for name in section.split("."):
        table = table.get(name, {})
    value = table.get(key)
    if isinstance(value, list):
        return tuple(float(item) for item in value)
    return (None if value is None else float(value),) * joints


# A load-side value of [machine] in motor coordinates: times the transmission ratio to this power, and its unit.
_AT_MOTOR = {
    "viscous_friction": (2, "N m s/rad"),
    "coulomb_friction": (1, "N m"),
    "constant_force": (1, "N m"),
    "drive_inertia": (2, "kg m2"),
}


def _as_in_file(machine: Machine, estimate: Estimate) -> tuple[str, str, tuple[float, ...]]:
    """Return key and unit of an estimate in the file, and the factor of each joint; the drives of a URDF stay as is."""
    key, ones = estimate.key, (1.0,) * len(machine.joints)
    if estimate.section != "machine":
        return key, estimate.unit, ones
    is_rotor = key == "drive_inertia" and not isinstance(machine, UrdfRobot)
    name = "motor_inertia" if is_rotor else getattr(machine, "inertia_key", key) if key == "load_mass" else key
    if not isinstance(machine, JointMachine) or machine.coordinates != "motor" or key not in _AT_MOTOR:
        return str(name), estimate.unit, ones
    if key == "drive_inertia" and not is_rotor:
        return str(name), estimate.unit, ones
    power, unit = _AT_MOTOR[key]
    # Dry friction has no sign.
    ratios = [abs(ratio) if key == "coulomb_friction" else ratio for ratio in machine.transmission_ratio]
    return str(name), unit, tuple(ratio**power for ratio in ratios)


def values_text(values: Sequence[float | None], significant: int = _DIGITS) -> str:
    """Return the values of all joints, one if they are alike; a dash for one that is not known."""
    known = [math.nan if value is None else value for value in values]
    texts = [digits(float(f"{value:.{significant}g}")) if math.isfinite(value) else "-" for value in known]
    return texts[0] if len(set(texts)) == 1 else ", ".join(texts)
