"""Is a URDF what the machine file takes it for? Told before pinocchio reads it, which names neither file nor joint."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from xml.etree import ElementTree

from cdtool.bounded_loading import read_bytes
from cdtool.errors import ConfigurationError, nearest

_MOVING = ("revolute", "continuous", "prismatic")
_MOST_TAGS, _MOST_ATTRIBUTES = 100_000, 200_000
# A chain of links is walked by recursion in the library that reads it.
_MOST_JOINTS = 1000
# How many numbers an attribute has; of those that are not named here, one.
_COUNTS = {"xyz": 3, "rpy": 3, "rgba": 4, "size": 3, "scale": 3}


def check_urdf(path: Path, joints: Sequence[str], locked: Mapping[str, float]) -> None:
    """Raises ConfigurationError unless numbers and types hold and each moving joint is logged or locked, once."""
    _check_names(path, _movable(path, _parse(path)), joints, locked)


def _parse(path: Path) -> ElementTree.Element:
    content = read_bytes(path, ConfigurationError, hint="a URDF file is needed", missing="check the path of the URDF")
    # Of each element, attribute and level a parser makes far more than the few bytes that they take here.
    if (
        content.count(b"<") > _MOST_TAGS
        or content.count(b"=") > _MOST_ATTRIBUTES
        or b"<!DOCTYPE" in content
        or b"\0" in content
    ):
        raise ConfigurationError(
            f"{path}: has more than {_MOST_TAGS} tags or {_MOST_ATTRIBUTES} attributes, or a DOCTYPE or NUL: refused",
            "a URDF file in UTF-8 is needed",
        )
    try:
        root = ElementTree.fromstring(content)
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
    joints = root.findall("joint")
    if len(joints) > _MOST_JOINTS:
        raise ConfigurationError(f"{path}: has {len(joints)} joints", f"at most {_MOST_JOINTS} are read")
    for joint in joints:
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
            numbers = [float(part) for part in text.split()]
        except ValueError:
            numbers = []
        count = _COUNTS.get(key, 1)
        if len(numbers) != count or not all(map(math.isfinite, numbers)):
            wanted = "a finite number is" if count == 1 else f"{count} finite numbers are"
            raise ConfigurationError(
                f"{who}: <{item.tag}> {key} is '{text}'", f"{wanted} needed; xacro files must be expanded first"
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
