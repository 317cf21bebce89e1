"""The model of a machine: inertia, friction, transmission. One file per type, named as in machine.toml."""

from __future__ import annotations

from cdtool.base.registry import Registry

MACHINES = Registry(
    kind="machine",
    table={
        "linear_axis": "cdtool.machines.linear_axis:LinearAxis",
        "rotary_axis": "cdtool.machines.rotary_axis:RotaryAxis",
        "planar_arm": "cdtool.machines.planar_arm:PlanarArm",
        "urdf_robot": "cdtool.machines.urdf_robot:UrdfRobot",
    },
    contract=("of", "read", "default_sides", "accepted_units", "referred_to_load"),
)
