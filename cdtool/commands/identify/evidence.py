"""What the logs show of a joint beside its numbers: an unseen run, friction over speed, the rest along the travel."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.commands.identify.axis.filtered_regression import IntArray


@dataclass(frozen=True, eq=False)
class FrictionCurve:
    """A force over speed or position: mean, standard error and number of equations of each point, all (g,).

    `abscissa`: signed speed [m/s, rad/s] or position [m, rad]; the middle of each interval. `mean` and
    `standard_error` [N, N m]. The standard error is that between strokes (NaN for a single stroke). An interval that
    no equation falls into is left out.
    """

    abscissa: FloatArray
    mean: FloatArray
    standard_error: FloatArray
    count: IntArray


def friction_curve(abscissa: FloatArray, force: FloatArray, stroke: IntArray, edges: FloatArray) -> FrictionCurve:
    """Return the mean force in intervals of speed or position.

    Parameters
    ----------
    abscissa, force : ndarray, shape (m,)
        Speed [m/s, rad/s] or position [m, rad], and the force [N, N m] there.
    stroke : ndarray of int, shape (m,)
        The stroke of each: the residuals of a stroke are correlated, so that strokes are what is independent.
    edges : ndarray, shape (g + 1,)
        Increasing edges of the intervals; what is outside is left out.

    Returns
    -------
    FrictionCurve
        The mean of the strokes' means, weighted by the number of equations.

    Examples
    --------
    >>> import numpy as np
    >>> speed, force, stroke = np.array([0.1, 0.1, 0.1, 0.3]), np.array([1.0, 1.0, 3.0, 5.0]), np.array([0, 0, 1, 1])
    >>> friction_curve(speed, force, stroke, np.array([0.0, 0.2, 0.4])).mean.round(3).tolist()
    [1.667, 5.0]
    """
    interval = np.searchsorted(edges, abscissa, side="right") - 1
    interval[abscissa == edges[-1]] = len(edges) - 2
    is_inside = (interval >= 0) & (interval < len(edges) - 1) & np.isfinite(force)
    middle = 0.5 * (edges[1:] + edges[:-1])
    rows: list[tuple[float, float, float, int]] = []
    for number in np.unique(interval[is_inside]):
        chosen = is_inside & (interval == number)
        _, which = np.unique(stroke[chosen], return_inverse=True)
        counts = np.bincount(which)
        means = np.bincount(which, weights=force[chosen]) / counts
        weights = counts / float(counts.sum())
        mean = float(weights @ means)
        error = math.nan
        if len(means) > 1:
            # Cluster-robust standard error of a weighted mean.
            error = math.sqrt(len(means) / (len(means) - 1) * float(np.sum((weights * (means - mean)) ** 2)))
        rows.append((float(middle[number]), mean, error, int(counts.sum())))
    columns = np.array(rows, dtype=np.float64).reshape(-1, 4).T
    return FrictionCurve(columns[0], columns[1], columns[2], columns[3].astype(np.int64))


def speed_edges(speed: FloatArray, intervals: int = 20) -> FloatArray:
    """Return edges (g + 1,) of equal intervals over the signed speeds, with an edge at 0."""
    low, high = min(float(np.min(speed)), 0.0), max(float(np.max(speed)), 0.0)
    width = max((high - low) / intervals, 1e-12)
    return width * np.arange(math.floor(low / width), math.ceil(high / width) + 1, dtype=np.float64)


@dataclass(frozen=True, eq=False)
class UnseenRun:
    """The force on a run whose parts were left out of the fit in turn: (n,) [N, N m] at `time` [s] while moving.

    `of_runs`: the number of runs it is the worst of.
    """

    run: str
    time: FloatArray
    measured: FloatArray
    predicted: FloatArray
    of_runs: int

    @property
    def error(self) -> float:
        """Return the root mean square of what the prediction leaves over [N, N m]."""
        return float(np.sqrt(np.mean((self.measured - self.predicted) ** 2)))


@dataclass(frozen=True, eq=False)
class CrossValidation:
    """How well the force is predicted while moving, in runs, or strokes of a single run, left out of the fit.

    `error` [N, N m]: root mean square. `folds`: how often something was left out. `floor` [N, N m]: standard deviation
    of the force between strokes that repeat each other, over `repeats` strokes; NaN without repeats. `worst`: the run
    that is described worst.
    """

    error: float
    folds: int
    floor: float
    repeats: int
    worst: UnseenRun

    @property
    def left_over(self) -> float:
        """Return the error over the floor; NaN without a floor."""
        return self.error / self.floor if self.floor > 0.0 else math.nan

    @property
    def summary(self) -> dict[str, Any]:
        """Return the errors as JSON values."""
        worst = {"worst_run": self.worst.run, "error_of_worst_run": self.worst.error, "of_runs": self.worst.of_runs}
        return {"error": self.error, "floor": self.floor, "repeats": self.repeats, **worst}


@dataclass(frozen=True, eq=False)
class ForceEvidence:
    """How well the model of a joint describes its logs.

    `speed`, `friction`, `residual` (m,): of each equation, the force without that of the inertia, and what the model
    leaves over. `friction_curve`: the friction over signed speed; `position_curves`: the residual over position, per
    direction (1, -1). `cross_validation` is None with a single stroke.
    """

    speed: FloatArray
    friction: FloatArray
    residual: FloatArray
    friction_curve: FrictionCurve
    position_curves: dict[int, FrictionCurve]
    cross_validation: CrossValidation | None

    @classmethod
    def of(
        cls,
        motion: tuple[FloatArray, FloatArray],
        friction: FloatArray,
        residual: FloatArray,
        stroke: IntArray,
        cross_validation: CrossValidation | None,
    ) -> ForceEvidence:
        """Return the evidence of equations (m,) with `motion`, their speed and position, in so many strokes."""
        (speed, position), curves = motion, {}
        edges = np.linspace(position.min(), position.max(), 51)
        for direction in (1, -1):
            inside = np.sign(speed) == direction
            if np.any(inside) and edges[-1] > edges[0]:
                curves[direction] = friction_curve(position[inside], residual[inside], stroke[inside], edges)
        over_speed = friction_curve(speed, friction, stroke, speed_edges(speed))
        return cls(speed, friction, residual, over_speed, curves, cross_validation)
