"""A drafted machine file of a robot that a URDF describes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from cdtool.base.errors import UsageError
from cdtool.base.plain_text import counted
from cdtool.base.remote.remote_path import relative_name
from cdtool.commands.init.draft_text import Draft, toml
from cdtool.commands.init.machine_side import Side
from cdtool.machines.urdf_reader import moving_joints


def of_robot(draft: Draft, urdf: Path) -> Draft:
    """Return the draft of a urdf_robot: its joints by their names, or else in the order of the URDF.

    Raises ConfigurationError for a URDF that cannot be read, UsageError if it has fewer joints than the log.
    """
    names, logged = moving_joints(urdf), draft.joints
    if len(names) < len(logged):
        raise UsageError(
            f"{urdf}: has {counted(len(names), 'moving joint')}, the log {len(logged)}", "give the URDF of this robot"
        )
    robot: dict[str, object] = {"urdf": str(urdf)}
    used = logged if set(logged) <= set(names) else names[: len(logged)]
    if used != logged:
        robot["joint_map"] = dict(zip(logged, used, strict=True))
    if locked := [name for name in names if name not in used]:
        robot["locked"] = dict.fromkeys(locked, 0.0)
    side = Side("urdf_robot", "load", "a URDF is given")
    return replace(draft, side=side, evidence=replace(draft.evidence, side=side), robot=robot)


def with_relative_urdf(text: str, urdf: Path, folder: Path) -> str:
    """Return the text of a draft that names its URDF relative to the folder of the draft."""
    return text.replace(toml(str(urdf.absolute())), toml(relative_name(urdf, folder)), 1)
