"""Table 4.1 of the thesis with corrected units, an elastic drive of the same size, and sensors on it."""

from __future__ import annotations

import math

from cdtool.impact.contact_laws.hunt_crossley import HuntCrossley
from cdtool.impact.drives import ConstantTorque, SpeedController
from cdtool.impact.sensor_ranking import ImpactCase
from cdtool.impact.sensors import Sensor
from cdtool.impact.transmissions.transmission import ElasticTransmission, RigidTransmission
from cdtool.impact.transmissions.transmission_simulation import SimulatedMotion, Start, simulate_impact

TRANSMISSION = RigidTransmission(inertia=2.35e-4, friction=0.03, ratio=0.015)
TORQUE = ConstantTorque(0.5)
CONTACT = HuntCrossley(stiffness=9.8261e8, damping=2.9478e8, exponent=1.5)
#: Not stated in the thesis [m]: the gap with which the touch is at its 408 ms.
GAP = 0.1

ELASTIC = ElasticTransmission(motor_inertia=1e-4, load_mass=0.6, ratio=0.015, stiffness=100.0)
"""J_m + M_l r^2 = J_t of Table 4.1; the thesis has no numbers for its figure 4.7."""

SPEED_LOOP = SpeedController(reference=0.25 / 0.015, proportional=0.05, integral=1.0, actuator_time=0.002)
"""Gains for the example of 4.39; the thesis has none."""

RANKED = ImpactCase(
    ElasticTransmission(1e-4, 0.6, 0.015, stiffness=100.0, damping=0.005, motor_friction=0.03),
    SPEED_LOOP,
    HuntCrossley(stiffness=1e5, damping=3e4, exponent=1.0),
    speed=0.25,
    window=0.1,
)
"""Figure 4.10: the same drive with some damping against a linear obstacle at a tenth of the limit 4.36."""

_RATED = 0.5 / 0.015  # N, from the torque and the pulley of Table 4.1
_COUNT = 2.0 * math.pi * 0.015 / 4096
SENSORS = (
    Sensor("load_cell", "at the contact", "contact_force", "N", 0.001 * _RATED, 0.0, 500.0, 1000.0),
    Sensor("torque_sensor", "in the drive", "drive_force", "N", 0.002 * _RATED, 0.0, 500.0, 1000.0),
    Sensor("accelerometer", "on the load", "load_acceleration", "m/s2", 0.1, 9.80665 / 4096, 100.0, 1000.0),
    Sensor("motor_position", "on the motor", "motor_position", "m", 0.0, _COUNT, math.inf, 1000.0),
    Sensor("motor_speed", "on the motor", "motor_position", "m/s", 0.0, _COUNT, 60.0, 1000.0, differentiated=True),
    Sensor("motor_torque", "control action", "motor_force", "N", 0.01 * _RATED, 0.0, 200.0, 1000.0),
)
"""Noise as the study command assumes it, of a drive rated for the torque of Table 4.1."""


def impact(duration: float = 0.5) -> SimulatedMotion:
    """The impact of figure 4.3, from rest."""
    return simulate_impact(TRANSMISSION, TORQUE, CONTACT, Start(gap=GAP), duration=duration)
