"""Inertial sensors on the links of a planar arm: what they measure across their links."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdtool.base.arrays import FloatArray


@dataclass(frozen=True)
class LinkSensors:
    """Sensors at `distance` (2,) [m] from the joints of two links; the second link's joint is at `arm_length` [m]."""

    distance: tuple[float, ...]
    arm_length: float
    gravity: float

    def specific_force(self, position: FloatArray, speed: FloatArray, acceleration: FloatArray) -> FloatArray:
        """Return what ideal sensors measure across their links (n, 2) [m/s2], gravity included.

        z1 = d1 a1 + g cos q1; z2 = d2 a2 + g cos q2 + l1 (a1 cos(q2 - q1) + v1^2 sin(q2 - q1)): the second one rides
        on the elbow (thesis 6.7, 6.26 corrected). Absolute angles (n, 2) [rad], speeds and accelerations of the links.
        """
        felt: FloatArray = np.array(self.distance) * acceleration + self.gravity * np.cos(position)
        between = position[:, 1] - position[:, 0]
        elbow = acceleration[:, 0] * np.cos(between) + speed[:, 0] ** 2 * np.sin(between)
        felt[:, 1] += self.arm_length * elbow
        return felt
