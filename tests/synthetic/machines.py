"""The axis and the planar arm with known parameters that many tests use."""

from __future__ import annotations

from cdtool.machines.linear_axis import LinearAxis
from cdtool.machines.planar_arm import PlanarArm

GATE = {
    "motor_inertia": 9.5e-4,
    "load_mass": 620.0,
    "transmission_ratio": 1.333e-3,
    "viscous_friction": 150.0 * 1.333e-3**2,
}


def machine_of(values: dict[str, object]) -> LinearAxis:
    """Return a linear axis from the keys of its [machine] table."""
    machine = LinearAxis.of(values)
    assert isinstance(machine, LinearAxis)
    return machine


ARM = {
    "coordinates": "motor",
    "link_mass": [1.3, 1.6],
    "link_length": 0.30,
    "centre_of_mass": [0.14, 0.18],
    "link_inertia": [0.012, 0.018],
    "motor_inertia": 1.5e-5,
    "transmission_ratio": 1.0 / 60.0,
    "viscous_friction": 0.4 / 60.0**2,
    "imu_position": [0.22, 0.20],
}


def arm_of(values: dict[str, object]) -> PlanarArm:
    """Return a planar arm from the keys of its [machine] table."""
    return PlanarArm.of(values)
