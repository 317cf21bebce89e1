"""Detectors: a recording and what is known of its machine -> a collision detection signal. One file a detector."""

from __future__ import annotations

from cdtool.registry import Registry

DETECTORS = Registry(
    kind="detector",
    table={
        "pure_torque": "cdtool.detectors.pure_torque:PureTorque",
        "pure_inertia": "cdtool.detectors.pure_inertia:PureInertia",
        "momentum": "cdtool.detectors.momentum:Momentum",
        "inertial_momentum": "cdtool.detectors.inertial_momentum:InertialMomentum",
        "friction_ekf": "cdtool.detectors.friction_ekf:FrictionEkf",
        "direct": "cdtool.detectors.direct:Direct",
        "desired_dynamics": "cdtool.detectors.desired_dynamics:DesiredDynamics",
        "energy": "cdtool.detectors.energy:Energy",
        "velocity": "cdtool.detectors.velocity:Velocity",
        "kalman_momentum": "cdtool.detectors.kalman_momentum:KalmanMomentum",
    },
    short_names={
        "pt": "pure_torque",
        "pi": "pure_inertia",
        "gm": "momentum",
        "igm": "inertial_momentum",
        "feekf": "friction_ekf",
        "dd": "direct",
        "ddd": "desired_dynamics",
        "eo": "energy",
        "vo": "velocity",
        "kmo": "kalman_momentum",
    },
    contract=("name", "short_name", "title", "needs", "signed", "unit", "signal"),
    settings=("unit", "meaning"),
)
