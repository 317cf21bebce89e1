"""The text of a URDF with identified inertial parameters; everything else stays as it was, comments included."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any
from xml.dom.minidom import parseString
from xml.parsers.expat import ExpatError

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import ConfigurationError, nearest
from cdtool.commands.identify.robot.consistent_inertia import body_of, is_consistent, pseudo_inertia
from cdtool.commands.identify.robot.robot_regressor import body_parameters
from cdtool.machines.kinematic_tree import KinematicTree, TreeLink

_ROTATIONAL = ("ixx", "ixy", "iyy", "ixz", "iyz", "izz")
_LEAST_MASS = 1e-9


def updated_urdf(text: str, tree: KinematicTree) -> str:
    """Return the URDF with the inertial parameters of a tree that was read from it; comments and layout stay.

    A joint's link carries them. Links that are fixed to it keep theirs if the rest is a physical body; else they lose
    them, and the joint's link carries all. Centre of mass and inertia are in the axes of the link, at full precision.
    Raises ConfigurationError for broken XML, a URDF of another robot, and for a moving body without mass.
    """
    try:
        document = parseString(text)
    except ExpatError as fault:
        raise ConfigurationError(
            f"broken XML in line {fault.lineno}, column {fault.offset + 1} of the URDF", "a URDF file is needed"
        ) from fault
    root: Any = document.documentElement
    elements = {link.getAttribute("name"): link for link in _children(root, "link")}
    if root.tagName != "robot" or not elements:
        raise ConfigurationError("the URDF has no link in <robot>", "a URDF's root is <robot>")
    links = {name: _read(link) for name, link in elements.items()}
    children = {joint.getAttribute("name"): _child(joint) for joint in _children(root, "joint")}
    for index, joint in enumerate(tree.joints):
        carried = [link for link in tree.links if link.joint == index and link.name in links]
        own = next((link for link in carried if link.name == children.get(joint.name)), None)
        if own is None:
            raise ConfigurationError(f"the URDF has no joint '{joint.name}' with a link", nearest(joint.name, children))
        fixed = [link for link in carried if link.name != own.name]
        total = pseudo_inertia(body_parameters(joint))
        matrix, emptied = _own_part(total, fixed, links)
        inverse = np.linalg.inv(_placement(own))
        _write(document, elements[own.name], inverse @ matrix @ inverse.T, joint.name)
        for link in emptied:
            for inertial in _children(elements[link.name], "inertial"):
                elements[link.name].removeChild(inertial)
    return str(document.toxml())


def _children(element: Any, tag: str) -> list[Any]:
    return [node for node in element.childNodes if node.nodeType == node.ELEMENT_NODE and node.tagName == tag]


def _child(joint: Any) -> str:
    return next((str(child.getAttribute("link")) for child in _children(joint, "child")), "")


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


def _read(link: Any) -> FloatArray:
    """Return a link's pseudo-inertia in its own frame; zero without mass and inertia."""
    from scipy.spatial.transform import Rotation

    matrix = np.zeros((4, 4))
    for inertial in _children(link, "inertial")[:1]:
        values = {node.tagName: node for tag in ("origin", "mass", "inertia") for node in _children(inertial, tag)[:1]}
        numbers = [_number(values.get("inertia"), key) for key in _ROTATIONAL]
        about_centre = pseudo_inertia(np.array([_number(values.get("mass"), "value"), 0.0, 0.0, 0.0, *numbers]))
        transform = np.eye(4)
        if "origin" in values:
            place, angles = (values["origin"].getAttribute(key) or "0 0 0" for key in ("xyz", "rpy"))
            transform[:3, 3] = [float(part) for part in place.split()]
            # Rz(yaw) Ry(pitch) Rx(roll), as a URDF defines rpy.
            transform[:3, :3] = Rotation.from_euler("xyz", [float(part) for part in angles.split()]).as_matrix()
        matrix = np.asarray(transform @ about_centre @ transform.T)
    return matrix


def _number(element: Any, key: str) -> float:
    return float(element.getAttribute(key) or "0") if element else 0.0


def _write(document: Any, link: Any, matrix: FloatArray, joint: str) -> None:
    """Write a pseudo-inertia in the link's frame as its origin, mass and inertia."""
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
    inertials = _children(link, "inertial")
    inertial = inertials[0] if inertials else link.appendChild(document.createElement("inertial"))
    attributes = {
        "origin": {"xyz": " ".join(map(repr, centre.tolist())), "rpy": "0 0 0"},
        "mass": {"value": repr(mass)},
        "inertia": {key: repr(value) for key, value in values.items()},
    }
    for tag, items in attributes.items():
        present = _children(inertial, tag)
        element = present[0] if present else inertial.appendChild(document.createElement(tag))
        for key, value in items.items():
            element.setAttribute(key, value)
