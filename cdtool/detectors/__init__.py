"""Detectors: from a recording and the model of its machine to a collision detection signal. One file per detector."""

from __future__ import annotations

from cdtool.base.registry import Registry
from cdtool.detectors.look import Look

# Name: (short name, class). The short name is repeated here so that `-d kmo` imports one detector, not all: the
# kernels of every imported module are compiled before work begins.
_TABLE = {
    "pure_torque": ("pt", "cdtool.detectors.pure_torque:PureTorque"),
    "pure_inertia": ("pi", "cdtool.detectors.pure_inertia:PureInertia"),
    "momentum": ("gm", "cdtool.detectors.momentum:Momentum"),
    "inertial_momentum": ("igm", "cdtool.detectors.inertial_momentum:InertialMomentum"),
    "friction_ekf": ("feekf", "cdtool.detectors.friction_ekf:FrictionEkf"),
    "direct": ("dd", "cdtool.detectors.direct:Direct"),
    "desired_dynamics": ("ddd", "cdtool.detectors.desired_dynamics:DesiredDynamics"),
    "energy": ("eo", "cdtool.detectors.energy:Energy"),
    "velocity": ("vo", "cdtool.detectors.velocity:Velocity"),
    "kalman_momentum": ("kmo", "cdtool.detectors.kalman_momentum:KalmanMomentum"),
    "torque_deviation": ("td", "cdtool.detectors.torque_deviation:TorqueDeviation"),
}

DETECTORS = Registry(
    kind="detector",
    table={name: target for name, (_, target) in _TABLE.items()},
    short_names={short: name for name, (short, _) in _TABLE.items()},
    contract=("name", "short_name", "title", "needs", "signed", "unit", "signal"),
    optional={"look": Look, "contact_torque": bool},
    settings=("unit", "meaning"),
)
