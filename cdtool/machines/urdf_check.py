"""Is a URDF what the machine file takes it for? Told before pinocchio reads it, which names neither file nor joint."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from xml.etree import ElementTree

from cdtool.errors import ConfigurationError, nearest

_MOVING = ("revolute", "continuous", "prismatic")


def check_urdf(path: Path, joints: Sequence[str], locked: Mapping[str, float]) -> None:
    """Raises ConfigurationError unless numbers and types hold and each moving joint is logged or locked, once."""
    _check_names(path, _movable(path, _parse(path)), joints, locked)


def _parse(path: Path) -> ElementTree.Element:
    try:
        root = ElementTree.fromstring(path.read_bytes())
    except FileNotFoundError:
        raise ConfigurationError(f"{path}: no such file", "check the path of the URDF") from None
    except OSError as fault:
        raise ConfigurationError(f"{path}: cannot be read: {fault}", "a URDF file is needed") from fault
    except ElementTree.ParseError as fault:
        line, column = fault.position
        raise ConfigurationError(
            f"{path}: broken XML in line {line}, column {column + 1}: {fault.msg.partition(':')[0]}",
            "a URDF file is needed",
        ) from fault
    if root.tag != "robot":
        hint = "expand it with xacro first" if path.suffix == ".xacro" else "a URDF's root is <robot>"
        raise ConfigurationError(f"{path}: not a URDF: its root is <{root.tag}>", hint)
    return root


def _movable(path: Path, root: ElementTree.Element) -> dict[str, str]:
    """Types of the moving joints by name, after a check of every number and type that is used."""
    for link in root.findall("link"):
        who = f"{path}: link '{link.get('name')}'"
        for item in link.findall("inertial//*"):
            _numbers(who, item)
        mass = link.find("inertial/mass")
        if mass is not None and float(mass.get("value", "0")) < 0.0:
            raise ConfigurationError(f"{who}: mass {mass.get('value')} kg is negative", "masses are 0 or more")
    types: dict[str, str] = {}
    for joint in root.findall("joint"):
        name, kind = joint.get("name", ""), joint.get("type", "")
        who = f"{path}: joint '{name}'"
        if kind not in (*_MOVING, "fixed"):
            raise ConfigurationError(
                f"{who}: type '{kind}' is not supported", f"supported: {', '.join(_MOVING)}, fixed"
            )
        for item in (*joint.findall("origin"), *joint.findall("axis")):
            _numbers(who, item)
        axis = joint.find("axis")
        if kind in _MOVING and axis is not None and not any(float(x) for x in axis.get("xyz", "1 0 0").split()):
            raise ConfigurationError(f"{who}: its axis has the length 0", "give a direction, as in xyz='0 0 1'")
        if kind in _MOVING:
            types[name] = kind
    return types


def _numbers(who: str, item: ElementTree.Element) -> None:
    for key, text in item.attrib.items():
        try:
            finite = all(math.isfinite(float(part)) for part in text.split())
        except ValueError:
            finite = False
        if not finite:
            raise ConfigurationError(
                f"{who}: <{item.tag}> {key} is '{text}'",
                "finite numbers are needed; xacro files must be expanded first",
            )


def _check_names(path: Path, types: Mapping[str, str], joints: Sequence[str], locked: Mapping[str, float]) -> None:
    for name in joints:
        if name not in types:
            raise ConfigurationError(
                f"{path}: no moving joint '{name}'",
                f"{nearest(name, types)}; joint_map maps the names of the log to the URDF's",
            )
        if joints.count(name) > 1:
            raise ConfigurationError(f"{path}: joint '{name}' is given twice", "name every joint once")
        if name in locked:
            raise ConfigurationError(
                f"{path}: joint '{name}' is both logged and locked", "remove it from one of the two"
            )
    for name, value in locked.items():
        if name not in types:
            raise ConfigurationError(f"{path}: no moving joint '{name}' to lock", nearest(name, types))
        if not math.isfinite(value):
            raise ConfigurationError(f"{path}: joint '{name}' is locked at {value}", "give a finite value in rad or m")
    free = [name for name in types if name not in joints and name not in locked]
    if free:
        listed = ", ".join(f"{name} = 0.0" for name in free)
        raise ConfigurationError(f"{path}: neither logged nor locked: {', '.join(free)}", f"locked = {{ {listed} }}")
    if not joints:
        raise ConfigurationError(f"{path}: no joint is logged", nearest("", types))
