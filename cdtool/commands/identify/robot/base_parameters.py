"""Base parameters: the combinations of a robot's parameters that its torques depend on, and which a motion excites.

Columns of the regressor that are linearly dependent on all motions cannot be told apart: with the independent columns
Y_b, Y pi = Y_b (pi_b + D pi_d) (Gautier, 1991, numerically by QR with column pivoting). What remains may still not
be excited by the logged motion: that is measured against random motion within the same speeds and accelerations.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdtool.base.arrays import FloatArray
from cdtool.commands.identify.robot.robot_regressor import Regressor, RegressorColumn, stacked_torque

# A column whose rest, after the projection on the others, is below this share of it is dependent on them; a factor
# below it is rounding.
_DEPENDENT = 1e-9


@dataclass(frozen=True, eq=False)
class Grouping:
    """The base parameters of a choice of columns: beta = combination @ pi, Y pi = Y[:, base] beta for every motion.

    `columns`: indices into the regressor's columns (P,); `base`: the B of them whose column stands for a combination;
    `combination` (B, P), the identity in the base columns, 0 in those without any effect on the torques.
    """

    columns: tuple[int, ...]
    base: tuple[int, ...]
    combination: FloatArray

    def is_alone(self, column: int) -> bool:
        """Return whether a column is a base parameter that contains no other parameter."""
        if column not in self.base:
            return False
        return int(np.count_nonzero(self.combination[self.base.index(column)])) == 1

    def name(self, row: int, columns: tuple[RegressorColumn, ...]) -> str:
        """Return a combination in words: the column's own parameter first, the others with their factors."""
        own = self.base[row]
        parts = [columns[own].name]
        for place, factor in zip(self.columns, self.combination[row].tolist(), strict=True):
            if place != own and factor:
                size = "" if abs(abs(factor) - 1.0) < _DEPENDENT else f"{abs(factor):.6g} "
                parts.append(f"{'+' if factor > 0.0 else '-'} {size}{columns[place].name}")
        return " ".join(parts)


@dataclass(frozen=True, eq=False)
class BaseParameterSet:
    """Identified base parameters: `values` (B,) of the combinations and their `covariance` (B, B), in SI units.

    `excitation` (B,): the part of the combination's column that is independent of all others, in the logged motion
    relative to random motion of the same speeds. `uncertainty` (B,): the standard error as a share of a joint's torque
    in such motion; `together`: that of all. The value of a combination that is not `identifiable` (B,) is worthless.
    """

    names: tuple[str, ...]
    values: FloatArray
    covariance: FloatArray
    excitation: FloatArray
    uncertainty: FloatArray
    together: float
    identifiable: tuple[bool, ...]

    @property
    def standard_errors(self) -> FloatArray:
        """Return the standard error of each combination (B,)."""
        return np.asarray(np.sqrt(np.diag(self.covariance)))


def group_columns(regressor: Regressor, columns: tuple[int, ...]) -> Grouping:
    """Return the base parameters of these columns of a regressor, from random motion (seeded)."""
    joints = 1 + max(column.joint for column in regressor.columns)
    rows = random_rows(regressor, columns, np.full(joints, 2.0), np.full(joints, 5.0))
    from scipy.linalg import qr, solve_triangular

    norms = np.linalg.norm(rows, axis=0)
    present = np.flatnonzero(norms > _DEPENDENT * max(float(norms.max(initial=0.0)), 1e-300))
    _, upper, order = qr(rows[:, present] / norms[present], mode="economic", pivoting=True)
    rank = int(np.count_nonzero(np.abs(np.diag(upper)) > _DEPENDENT * abs(upper[0, 0]))) if len(present) else 0
    kept, rest = present[order[:rank]], present[order[rank:]]
    factors = solve_triangular(upper[:rank, :rank], upper[:rank, rank:]) if len(rest) else np.zeros((rank, 0))
    # The columns were scaled to length 1.
    factors = factors / norms[kept][:, np.newaxis] * norms[rest]
    combination = np.zeros((rank, len(columns)))
    combination[np.arange(rank), kept] = 1.0
    combination[:, rest] = np.where(np.abs(factors) > _DEPENDENT, factors, 0.0)
    sequence = np.argsort(kept)
    return Grouping(
        columns=tuple(columns),
        base=tuple(columns[place] for place in kept[sequence].tolist()),
        combination=combination[sequence],
    )


def random_rows(
    regressor: Regressor, columns: tuple[int, ...], highest_speed: FloatArray, highest_acceleration: FloatArray
) -> FloatArray:
    """Return the regressor (n J, columns) of random motion, uniform within +-pi [rad, m] and the limits (J,)."""
    joints = len(highest_speed)
    # States in any order and number give the same rank; these do so again in each call.
    count = max(200, 2 * len(columns))
    position, speed, acceleration = np.random.default_rng(20_210).uniform(-1.0, 1.0, (3, count, joints))
    position = np.pi * position
    motion = position, speed * highest_speed, acceleration * highest_acceleration
    return stacked_torque(regressor, list(columns), *motion).reshape(count * joints, len(columns))


def independent_norms(rows: FloatArray) -> FloatArray:
    """Return the norm of the part of each column (B,) that is independent of all others; 0 without one.

    1 / sqrt of the diagonal of (Y'Y)^-1: white noise of standard deviation s makes a standard error of s / norm.
    """
    scale = column_scale(rows)
    parts = np.zeros(rows.shape[1])
    own = scale > 0.0
    if len(rows) < len(scale) or not own.any():
        return parts
    upper: FloatArray = np.asarray(np.linalg.qr(rows[:, own] * scale[own], mode="r"))
    _, values, right = np.linalg.svd(upper)
    # The rounding of two equal columns must not pass for a part of a third one.
    floor = 1e-8 * values[0]
    inflation = np.sum((right / np.maximum(values, floor)[:, np.newaxis]) ** 2, axis=0)
    parts[own] = 1.0 / (scale[own] * np.sqrt(inflation))
    return parts


def column_scale(rows: FloatArray) -> FloatArray:
    """Return 1 / length of each column (B,); 0 for one that is zero but for rounding."""
    norms = np.linalg.norm(rows, axis=0)
    is_zero = norms <= 1e-10 * max(float(norms.max(initial=0.0)), 1e-300)
    return np.where(is_zero, 0.0, 1.0 / np.where(is_zero, 1.0, norms))


def condition_number(rows: FloatArray) -> float:
    """Return the condition number of the rows with columns scaled to the same length; infinite if one is zero."""
    scale = column_scale(rows)
    if not scale.size:
        return 1.0
    if not scale.all() or len(rows) < len(scale):
        return float("inf")
    return float(np.linalg.cond(np.asarray(np.linalg.qr(rows * scale, mode="r"))))
