"""Force curves of obstacles."""

from __future__ import annotations

import numpy as np
import pytest

from cdtool.base.errors import ConfigurationError
from cdtool.machines.axis_model.obstacle import Obstacle


def test_the_series_stiffness_widens_each_point_by_its_force() -> None:
    obstacle = Obstacle((0.0, 0.01, 0.03), (0.0, 100.0, 120.0), series_stiffness=1e4)
    np.testing.assert_allclose(obstacle.penetration_curve, [[0.0, 0.02, 0.042], [0.0, 100.0, 120.0]])


@pytest.mark.parametrize(
    ("deflection", "force", "message"),
    [
        ((0.0,), (0.0,), "two or more points"),
        ((0.0, 1.0), (0.0,), "two or more points"),
        ((0.1, 1.0), (0.0, 5.0), "begins at"),
        ((0.0, 1.0, 0.5), (0.0, 1.0, 2.0), "turns back"),
        ((0.0, 1.0, 2.0), (0.0, 2.0, 1.0), "falls"),
        ((0.0, 1.0, 2.0), (0.0, 0.0, 1.0), "without a rise"),
        ((0.0, 1.0, 2.0), (0.0, 1.0, 1.0), "without a rise"),
        ((0.0, float("nan")), (0.0, 1.0), "turns back"),
    ],
)
def test_a_curve_that_is_not_a_force_curve_is_refused(
    deflection: tuple[float, ...], force: tuple[float, ...], message: str
) -> None:
    with pytest.raises(ConfigurationError, match=message):
        Obstacle(deflection, force)
