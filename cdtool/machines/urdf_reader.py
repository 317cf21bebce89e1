"""URDF -> KinematicTree. pinocchio reads it (extra cdtool[urdf]): kinematics and inertias, never meshes.

Conventions: each joint's frame is turned so that its axis is z; link frames keep the URDF's axes. Locked joints become
fixed ones. An error in a file is a ConfigurationError on one line that names file, joint or link.
"""

from __future__ import annotations

import math
import os
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import ConfigurationError, installing, nearest
from cdtool.base.files.bounded_loading import read_bytes
from cdtool.machines.kinematic_tree import KinematicTree, TreeJoint, TreeLink

_STANDARD_GRAVITY = (0.0, 0.0, -9.81)
_MOVING = ("revolute", "continuous", "prismatic")
# A robot has some hundred: a file with more is refused before it is parsed.
_MOST_TAGS, _MOST_ATTRIBUTES = 100_000, 200_000
# The library that reads a chain of links does so by recursion.
_MOST_JOINTS = 1000
# The number of values of an attribute; one if it is not named here.
_COUNTS = {"xyz": 3, "rpy": 3, "rgba": 4, "size": 3, "scale": 3}


def read_urdf(
    path: Path,
    joints: Sequence[str],
    locked: Mapping[str, float],
    drive_inertia: Sequence[float] = (),
    gravity: tuple[float, float, float] = _STANDARD_GRAVITY,
) -> KinematicTree:
    """Return the tree of the moving joints of a URDF, columns in the order of `joints`.

    Every revolute, continuous or prismatic joint is either in `joints` or frozen at a value of `locked` [rad or m]; one
    that mimics another counts as a joint of its own. `drive_inertia` [kg m2 or kg], on the load side, one for each of
    `joints`, () for none. `gravity` [m/s2] is in the axes of the root link. Raises ConfigurationError.
    """
    _check_urdf(path, joints, locked)
    if drive_inertia and len(drive_inertia) != len(joints):
        raise ConfigurationError(f"{len(drive_inertia)} values of drive_inertia, {len(joints)} joints", "one per joint")
    drives = dict(zip(joints, drive_inertia or (0.0,) * len(joints), strict=True))
    pinocchio = _pinocchio(path)
    model = _reduced(pinocchio, _build(pinocchio, path), locked)
    frames = [_z_along(_axis(model, index)) for index in range(1, model.njoints)]
    tree = KinematicTree(
        joints=tuple(_joint(model, index, frames, drives) for index in range(1, model.njoints)),
        links=tuple(_links(pinocchio, model, frames)),
        order=tuple(joints),
        gravity=gravity,
    )
    _check_inertia(path, tree)
    return tree


def moving_joints(path: Path) -> tuple[str, ...]:
    """Return the names of the moving joints of a URDF, in its order; raises ConfigurationError."""
    return tuple(_movable(path, _parse(path)))


def _pinocchio(path: Path) -> Any:
    try:
        return import_module("pinocchio")
    except ModuleNotFoundError as fault:
        raise ConfigurationError(
            f"{path}: reading a URDF needs pinocchio, which is not installed", installing("urdf")
        ) from fault
    except ImportError as fault:  # a library of the system that the wheel does not contain
        why = str(fault).partition("\n")[0]
        raise ConfigurationError(
            f"{path}: reading a URDF needs pinocchio, which cannot be loaded: {why}",
            "install the named library (libgomp.so.1 on Debian: apt-get install libgomp1)",
        ) from fault


def _build(pinocchio: Any, path: Path) -> Any:
    with _error_stream() as said:
        try:
            return pinocchio.buildModelFromUrdf(os.fspath(path))
        except (ValueError, RuntimeError) as fault:
            lines = [line.strip() for line in said().splitlines() if line.startswith("Error:")]
            reason = lines[0].removeprefix("Error:").strip() if lines else str(fault).partition("\n")[0]
    raise ConfigurationError(f"{path}: not a valid URDF: {reason}", "check links and joints")


@contextmanager
def _error_stream() -> Iterator[Callable[[], str]]:
    """Capture what C++ code writes to the error stream: the reason for an error is only there."""
    with tempfile.TemporaryFile() as kept:
        terminal = os.dup(2)
        os.dup2(kept.fileno(), 2)

        def said() -> str:
            kept.seek(0)
            return kept.read().decode("utf-8", "replace")

        try:
            yield said
        finally:
            os.dup2(terminal, 2)
            os.close(terminal)


def _reduced(pinocchio: Any, model: Any, locked: Mapping[str, float]) -> Any:
    """Return the model with its locked joints fixed."""
    configuration = pinocchio.neutral(model)
    for name, value in locked.items():
        index = model.getJointId(name)
        first = model.idx_qs[index]
        # A continuous joint's configuration is a point of the circle.
        place = (value,) if model.nqs[index] == 1 else (math.cos(value), math.sin(value))
        configuration[first : first + len(place)] = place
    return pinocchio.buildReducedModel(model, [model.getJointId(name) for name in locked], configuration)


def _axis(model: Any, index: int) -> tuple[bool, FloatArray]:
    """Return whether a joint slides, and its axis in its frame: the motion subspace is (linear, angular)."""
    joint = model.joints[index]
    data = joint.createData()
    joint.calc(data, np.array([1.0, 0.0])[: joint.nq])
    subspace = np.asarray(data.S).ravel()
    slides = bool(np.any(subspace[:3]))
    return slides, subspace[:3] if slides else subspace[3:]


def _z_along(found: tuple[bool, FloatArray]) -> tuple[bool, FloatArray]:
    """Return whether it slides, and the rotation that turns z to the axis, exact for an axis of the frame."""
    slides, axis = found
    axis = axis / np.linalg.norm(axis)
    y = np.cross(axis, (1.0, 0.0, 0.0) if abs(axis[0]) < 0.9 else (0.0, 1.0, 0.0))
    y /= np.linalg.norm(y)
    return slides, np.column_stack((np.cross(y, axis), y, axis))


def _joint(model: Any, index: int, frames: Sequence[tuple[bool, FloatArray]], drives: Mapping[str, float]) -> TreeJoint:
    slides, turned = frames[index - 1]
    parent, placement, body = int(model.parents[index]), model.jointPlacements[index], model.inertias[index]
    outer = frames[parent - 1][1] if parent else np.eye(3)
    mass, centre = float(body.mass), turned.T @ body.lever
    inertia = turned.T @ body.inertia @ turned + mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
    return TreeJoint(
        name=model.names[index],
        parent=parent - 1,
        prismatic=slides,
        rotation=_floats(outer.T @ placement.rotation @ turned),
        translation=_floats(outer.T @ placement.translation),
        mass=mass,
        first_moment=_floats(mass * centre),
        inertia=_floats(inertia[np.triu_indices(3)]),
        drive_inertia=float(drives[model.names[index]]),
    )


def _links(pinocchio: Any, model: Any, frames: Sequence[tuple[bool, FloatArray]]) -> Iterator[TreeLink]:
    for frame in model.frames:
        if frame.type == pinocchio.FrameType.BODY:
            joint = int(frame.parentJoint)
            turned = frames[joint - 1][1] if joint else np.eye(3)
            rotation = _floats(turned.T @ frame.placement.rotation)
            yield TreeLink(frame.name, joint - 1, rotation, _floats(turned.T @ frame.placement.translation))


def _check_inertia(path: Path, tree: KinematicTree) -> None:
    """Check that M at position 0 is positive definite; single links may be unphysical, as identified ones often are."""
    matrix = tree.inertia_matrix(np.zeros((1, len(tree.order))))[0]
    for name, inertia in zip(tree.order, np.diag(matrix), strict=True):
        if not inertia > 0.0:
            raise ConfigurationError(
                f"{path}: joint '{name}' moves no inertia ({inertia:.3g})",
                "give its links mass and inertia, or drive_inertia in the machine file",
            )
    try:
        np.linalg.cholesky(matrix)
    except np.linalg.LinAlgError as fault:
        raise ConfigurationError(
            f"{path}: the inertia matrix at position 0 is not positive definite",
            "correct the links' inertias, or give drive_inertia in the machine file",
        ) from fault


def _floats(values: FloatArray) -> tuple[float, ...]:
    return tuple(np.asarray(values, dtype=np.float64).ravel().tolist())


def _check_urdf(path: Path, joints: Sequence[str], locked: Mapping[str, float]) -> None:
    """Raise ConfigurationError unless numbers and types are valid and each moving joint is logged or locked, once."""
    _check_names(path, _movable(path, _parse(path)), joints, locked)


def _parse(path: Path) -> ElementTree.Element:
    content = read_bytes(path, ConfigurationError, hint="a URDF file is needed", missing="check the path of the URDF")
    # For each element, attribute and level a parser needs far more memory than the few bytes that they have here.
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
    """Return the types of the moving joints by name, after a check of every number and type that is used."""
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
