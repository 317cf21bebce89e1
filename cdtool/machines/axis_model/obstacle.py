"""An obstacle: its force over its deflection, its damping, and where it stands."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.base.derived import StoresDerived
from cdtool.base.errors import ConfigurationError


@dataclass(frozen=True)
class Obstacle(StoresDerived):
    """An obstacle with the force T(deflection) (1 + damping * speed), at least 0.

    `deflection` [m] and `force` [N] are the points of a piecewise-linear curve from (0, 0); beyond the last point it
    goes on with the last slope. `series_stiffness` [N/m]: what is in series with it, such as a load cell; infinite if
    nothing is. `damping` [s/m]. It stands at `position` [m] and is approached in `direction` +1 or -1. On a rotary axis
    the units are rad, N m, N m/rad, s/rad.
    """

    deflection: tuple[float, ...]
    force: tuple[float, ...]
    damping: float = 0.0
    series_stiffness: float = math.inf
    position: float = 0.0
    direction: int = 1

    def __post_init__(self) -> None:
        points = list(zip(self.deflection, self.force, strict=False))
        if len(self.deflection) != len(self.force) or len(points) < 2:
            raise ConfigurationError("a force curve needs two or more points", "give deflection and force of each")
        if points[0] != (0.0, 0.0):
            raise ConfigurationError(f"a force curve begins at {points[0]}", "begin with deflection 0 and force 0")
        steps = np.diff(np.array(points), axis=0)
        if not np.all(np.isfinite(steps)) or np.any(steps[:, 0] <= 0.0) or np.any(steps[:, 1] < 0.0):
            raise ConfigurationError(
                "a force curve falls or turns back", "deflection must increase, force not decrease"
            )
        if self.force[1] <= 0.0 or self.force[-1] <= self.force[-2]:
            raise ConfigurationError(
                "a force curve begins or ends without a rise", "its first and its last section need a stiffness above 0"
            )
        if not self.damping >= 0.0 or not self.series_stiffness > 0.0:
            raise ConfigurationError("damping must be at least 0, series_stiffness above 0")
        if self.direction not in (1, -1):
            raise ConfigurationError(f"direction is {self.direction}", "1 or -1")

    @classmethod
    def spring(cls, stiffness: float, damping: float = 0.0, series_stiffness: float = math.inf) -> Obstacle:
        """Return an obstacle of one stiffness [N/m]; raises ConfigurationError unless it is above 0 and finite."""
        if not 0.0 < stiffness < math.inf:
            raise ConfigurationError(f"an obstacle's stiffness is {stiffness}", "above 0 and finite, in N/m")
        return cls((0.0, 1.0), (0.0, stiffness), damping, series_stiffness)

    def at(self, position: float, direction: int) -> Obstacle:
        """Return the obstacle at a position [m], approached in a direction."""
        return replace(self, position=position, direction=direction)

    def on_lever(self, lever: float) -> Obstacle:
        """Return the obstacle as a rotary axis meets it with the end of a lever [m]: in rad, N m and N m/rad."""
        return replace(
            self,
            deflection=tuple(item / lever for item in self.deflection),
            force=tuple(item * lever for item in self.force),
            damping=self.damping * lever,
            series_stiffness=self.series_stiffness * lever**2,
        )

    @cached_property
    def penetration_curve(self) -> FloatArray:
        """(2, points): penetration [m] and force [N] with the series stiffness folded in."""
        force = np.array(self.force)
        return np.ascontiguousarray([np.array(self.deflection) + force / self.series_stiffness, force])

    @property
    def steepest(self) -> float:
        """Return the largest stiffness of the curve, with what is in series [N/m]."""
        penetration, force = self.penetration_curve
        return float(np.max(np.diff(force) / np.diff(penetration)))
