"""The text of a URDF with identified inertial parameters; everything else stays as it was, comments included."""

from __future__ import annotations

from typing import Any
from xml.dom.minidom import parseString
from xml.parsers.expat import ExpatError

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.errors import ConfigurationError, nearest
from cdtool.commands.identify.robot.consistent_inertia import body_of, pseudo_inertia
from cdtool.commands.identify.robot.robot_regressor import body_parameters
from cdtool.machines.kinematic_tree import KinematicTree

_ROTATIONAL = ("ixx", "ixy", "iyy", "ixz", "iyz", "izz")


def updated_urdf(text: str, tree: KinematicTree) -> str:
    """Return the URDF with the inertial parameters of a tree that was read from it; comments and layout stay.

    A joint's link carries those of all that the joint moves; links that are fixed to it lose theirs. Centre of mass and
    inertia are in the axes of the link, at full precision.
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
    children = {joint.getAttribute("name"): _child(joint) for joint in _children(root, "joint")}
    for index, joint in enumerate(tree.joints):
        carried = [link for link in tree.links if link.joint == index and link.name in elements]
        own = next((link for link in carried if link.name == children.get(joint.name)), None)
        if own is None:
            raise ConfigurationError(f"the URDF has no joint '{joint.name}' with a link", nearest(joint.name, children))
        # T P T' moves a pseudo-inertia P, the integral of (r, 1)(r, 1)' dm, to another frame.
        placement = np.eye(4)
        placement[:3, :3], placement[:3, 3] = np.reshape(own.rotation, (3, 3)), own.translation
        inverse = np.linalg.inv(placement)
        _write(document, elements[own.name], inverse @ pseudo_inertia(body_parameters(joint)) @ inverse.T, joint.name)
        for link in carried:
            for inertial in _children(elements[link.name], "inertial") if link is not own else ():
                elements[link.name].removeChild(inertial)
    return str(document.toxml())


def _children(element: Any, tag: str) -> list[Any]:
    return [node for node in element.childNodes if node.nodeType == node.ELEMENT_NODE and node.tagName == tag]


def _child(joint: Any) -> str:
    return next((str(child.getAttribute("link")) for child in _children(joint, "child")), "")


def _write(document: Any, link: Any, matrix: FloatArray, joint: str) -> None:
    """Write a pseudo-inertia in the link's frame as its origin, mass and inertia."""
    mass = float(matrix[3, 3])
    if mass < 1e-9:  # kg
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
