"""The text of a URDF with identified inertial parameters; every other byte stays as it was, comments included."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from xml.etree import ElementTree
from xml.parsers import expat

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import ConfigurationError, nearest
from cdtool.commands.identify.robot.consistent_inertia import body_of, is_consistent, pseudo_inertia
from cdtool.commands.identify.robot.robot_regressor import body_parameters
from cdtool.machines.kinematic_tree import KinematicTree, TreeLink

_ROTATIONAL = ("ixx", "ixy", "iyy", "ixz", "iyz", "izz")
_LEAST_MASS = 1e-9
# A start tag; a quoted value may contain ">".
_TAG = re.compile(rb"""<(?:[^>"']|"[^"]*"|'[^']*')*>""")
_STEP = "  "


def updated_urdf(text: str, tree: KinematicTree) -> str:
    """Return the URDF with the inertial parameters of a tree that was read from it.

    A joint's link carries them. Links that are fixed to it keep theirs if the rest is a physical body; else they lose
    them, and the joint's link carries all. Centre of mass and inertia are in the axes of the link, at full precision.
    Raises ConfigurationError for broken XML, a URDF of another robot, and for a moving body without mass.
    """
    data = text.encode()
    places, root = _places(data), ElementTree.fromstring(data.partition(b"?>")[2] if _is_declared(data) else data)
    links = {link.get("name", ""): _read(link) for link in root.findall("link")}
    children = {joint.get("name", ""): _child(joint) for joint in root.findall("joint")}
    edits: list[_Edit] = []
    for index, joint in enumerate(tree.joints):
        carried = [link for link in tree.links if link.joint == index and link.name in links]
        own = next((link for link in carried if link.name == children.get(joint.name)), None)
        if own is None:
            raise ConfigurationError(f"the URDF has no joint '{joint.name}' with a link", nearest(joint.name, children))
        fixed = [link for link in carried if link.name != own.name]
        total = pseudo_inertia(body_parameters(joint))
        matrix, emptied = _own_part(total, fixed, links)
        inverse = np.linalg.inv(_placement(own))
        edits.append(places[own.name].replacement(data, _numbers(inverse @ matrix @ inverse.T, joint.name)))
        edits.extend(places[link.name].removal(data) for link in emptied if places[link.name].inertial)
    for edit in sorted(edits, key=lambda item: item.start, reverse=True):
        data = data[: edit.start] + edit.text + data[edit.end :]
    return data.decode()


@dataclass(frozen=True)
class _Edit:
    """Bytes `start` to `end` become `text`."""

    start: int
    end: int
    text: bytes


@dataclass
class _LinkPlace:
    """Where a link is: the bytes of its start tag, and of its <inertial> (start, end), None without one."""

    tag: tuple[int, int]
    inertial: tuple[int, int] | None = None

    def replacement(self, data: bytes, numbers: Sequence[str]) -> _Edit:
        """Return the edit that writes origin, mass and inertia."""
        if self.inertial:
            margin = _margin(data, self.inertial[0])
            return _Edit(*self.inertial, _element(numbers, margin, _inner_margin(data, self.inertial)))
        outer = _margin(data, self.tag[0])
        margin = outer + _STEP
        start, end = self.tag
        tag = data[start:end]
        inner = f"\n{margin}".encode() + _element(numbers, margin, margin + _STEP)
        if not tag.endswith(b"/>"):
            return _Edit(end, end, inner)
        opened = tag[:-2].rstrip() + b">"
        return _Edit(start, end, opened + inner + f"\n{outer}</link>".encode())

    def removal(self, data: bytes) -> _Edit:
        """Return the edit that removes the inertial element and its line."""
        assert self.inertial is not None
        start, end = self.inertial
        while start and data[start - 1 : start] in (b" ", b"\t"):
            start -= 1
        return _Edit(start - (data[start - 1 : start] == b"\n"), end, b"")


def _is_declared(data: bytes) -> bool:
    return data.lstrip().startswith(b"<?xml")


def _places(data: bytes) -> dict[str, _LinkPlace]:
    """Return where each link of the robot is; raises ConfigurationError for broken XML and another root."""
    parser = expat.ParserCreate("utf-8")
    path: list[str] = []
    places: dict[str, _LinkPlace] = {}
    current: list[_LinkPlace] = []

    def start(tag: str, attributes: dict[str, str]) -> None:
        path.append(tag)
        at = parser.CurrentByteIndex
        if path == ["robot", "link"]:
            current[:] = [_LinkPlace((at, _tag_end(data, at)))]
            places[attributes.get("name", "")] = current[0]
        elif path == ["robot", "link", "inertial"] and current[0].inertial is None:
            current[0].inertial = (at, _tag_end(data, at))

    def end(_: str) -> None:
        at = parser.CurrentByteIndex
        own = current[0].inertial if path == ["robot", "link", "inertial"] else None
        # The end of an empty element <inertial/> is its start.
        if own and at >= own[1] and at == data.find(b"</inertial", own[0]):
            current[0].inertial = (own[0], _tag_end(data, at))
        path.pop()

    parser.StartElementHandler, parser.EndElementHandler = start, end
    try:
        parser.Parse(data, True)
    except expat.ExpatError as fault:
        raise ConfigurationError(
            f"broken XML in line {fault.lineno}, column {fault.offset + 1} of the URDF", "a URDF file is needed"
        ) from fault
    if not places:
        raise ConfigurationError("the URDF has no link in <robot>", "a URDF's root is <robot>")
    return places


def _tag_end(data: bytes, start: int) -> int:
    found = _TAG.match(data, start)
    return found.end() if found else start


def _margin(data: bytes, at: int) -> str:
    """Return the white space in front of a tag in its line."""
    line = data[data.rfind(b"\n", 0, at) + 1 : at]
    return line.decode() if not line.strip() else ""


def _inner_margin(data: bytes, span: tuple[int, int]) -> str:
    """Return the white space in front of the first element inside a span."""
    found = re.search(rb"\n([ \t]*)<[^/]", data[span[0] : span[1]])
    return found[1].decode() if found else _margin(data, span[0]) + _STEP


def _element(numbers: Sequence[str], margin: str, inner: str) -> bytes:
    return "\n".join(("<inertial>", *(inner + line for line in numbers), f"{margin}</inertial>")).encode()


def _child(joint: ElementTree.Element) -> str:
    child = joint.find("child")
    return child.get("link", "") if child is not None else ""


def _own_part(
    total: FloatArray, fixed: Sequence[TreeLink], links: Mapping[str, FloatArray]
) -> tuple[FloatArray, Sequence[TreeLink]]:
    """Return the pseudo-inertia of a joint's own link, in the joint's frame, and the links that lose theirs."""
    # T P T' moves a pseudo-inertia P, the integral of (r, 1)(r, 1)' dm, to another frame.
    moved = (_placement(link) @ links[link.name] @ _placement(link).T for link in fixed)
    rest = total - sum(moved, np.zeros((4, 4)))
    if not fixed or is_consistent(body_of(rest)):
        return rest, ()
    return total, fixed


def _placement(link: TreeLink) -> FloatArray:
    """Return the homogeneous transform (4, 4) from a link's frame to its joint's."""
    matrix = np.eye(4)
    matrix[:3, :3] = np.reshape(link.rotation, (3, 3))
    matrix[:3, 3] = link.translation
    return matrix


def _read(link: ElementTree.Element) -> FloatArray:
    """Return a link's pseudo-inertia in its own frame; zero without mass and inertia."""
    inertial = link.find("inertial")
    if inertial is None:
        return np.zeros((4, 4))
    origin, mass, inertia = inertial.find("origin"), inertial.find("mass"), inertial.find("inertia")
    numbers = [float(inertia.get(key, "0")) if inertia is not None else 0.0 for key in _ROTATIONAL]
    weight = float(mass.get("value", "0")) if mass is not None else 0.0
    about_centre = pseudo_inertia(np.array([weight, 0.0, 0.0, 0.0, *numbers]))
    transform = np.eye(4)
    if origin is not None:
        transform[:3, 3] = [float(part) for part in origin.get("xyz", "0 0 0").split()]
        transform[:3, :3] = _rotation([float(part) for part in origin.get("rpy", "0 0 0").split()])
    return np.asarray(transform @ about_centre @ transform.T)


def _rotation(angles: Sequence[float]) -> FloatArray:
    """Return Rz(yaw) Ry(pitch) Rx(roll), as a URDF defines rpy."""
    (sr, sp, sy), (cr, cp, cy) = (list(map(function, angles)) for function in (math.sin, math.cos))
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
            [-sp, cp * sr, cp * cr],
        ]
    )


def _numbers(matrix: FloatArray, joint: str) -> tuple[str, str, str]:
    """Return the elements origin, mass and inertia of a pseudo-inertia in the link's frame."""
    mass = float(matrix[3, 3])
    if mass < _LEAST_MASS:
        raise ConfigurationError(
            f"joint '{joint}' moves a mass of {mass:.3g} kg, for which a URDF has no form",
            "use consistent_fit, whose links are physical",
        )
    centre = matrix[:3, 3] / mass
    shift = np.eye(4)
    shift[:3, 3] = -centre
    values = dict(zip(_ROTATIONAL, body_of(shift @ matrix @ shift.T)[4:].tolist(), strict=True))
    place = " ".join(repr(value) for value in centre.tolist())
    inertia = " ".join(f'{key}="{value!r}"' for key, value in sorted(values.items()))
    return f'<origin xyz="{place}" rpy="0 0 0"/>', f'<mass value="{mass!r}"/>', f"<inertia {inertia}/>"
