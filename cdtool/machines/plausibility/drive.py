"""Whether a torque is that of the drive: friction takes power, and starts show the inertia.

tau = g(q) + sum_k m_k a_k + f sign(v) + d (|v| - mean |v|) sign(v) + sum_k f_k sign(v_k) over windows in motion: g is a
polynomial of the positions (weight, springs), f the friction at the mean speed. All positions and accelerations stand
for the coupling of a robot. Without motion in both directions g and f cannot be told apart: then f is the mean, and
counts only together with the inertia that starts show.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.findings import Finding
from cdtool.machines.dynamics import Machine
from cdtool.machines.plausibility.check import Answer, ChannelCheck
from cdtool.machines.plausibility.windows import Windows, windows_of
from cdtool.recordings.recording import Recording

# A joint below this share of the fastest hardly moves.
_HARDLY = 0.02
# A coefficient is sure if it is this share of the torque's spread: a smaller one may be that of another term.
_SHARE = 0.1
# The inertia of the machine file may be wrong by this factor.
_FACTOR = 3.0


# The answer by the signs of friction and inertia, 0 if not sure. Friction alone is sure of several joints only.
_VERDICTS: dict[tuple[int, int], tuple[Answer, str]] = {
    **{(1, inertia): ("agrees", "friction") for inertia in (-1, 0, 1)},
    (-1, -1): ("contradicts", "friction"),
    (-1, 0): ("not checked", "against"),
}


@dataclass(frozen=True)
class _Terms:
    """Coefficients, how many standard errors each is, and its share of the torque's spread, by name of the column."""

    value: dict[str, float]
    errors: dict[str, float]
    share: dict[str, float]


def drive_checks(recordings: Sequence[Recording], machine: Machine) -> Iterator[Finding]:
    """Yield for each joint what its torque shows about its friction, and about the inertia of an axis."""
    names = ("torque", "speed", *(["position"] if all("position" in item for item in recordings) else []))
    windows = windows_of(recordings, names)
    if windows is None:
        return
    joints = machine.joints
    checks: list[ChannelCheck] = []
    for j, joint in enumerate(joints):
        check = ChannelCheck("friction", "not checked", "few", joint if len(joints) > 1 else "", "torque")
        checks += _checked(check, windows, j, machine)
    # A load that changes with the direction, as on a lift, looks like friction of the wrong sign on one joint.
    against = [item for item in checks if item.found == "against"]
    is_sure = len(against) > 1 and not any(item.answer == "agrees" for item in checks)
    for item in checks:
        if item in against:
            item = replace(item, answer="contradicts", found="friction") if is_sure else replace(item, found="unclear")
        yield item.finding()


def _checked(check: ChannelCheck, windows: Windows, j: int, machine: Machine) -> Iterator[ChannelCheck]:
    torque = windows.means["torque"][:, j]
    speed, position = (
        np.where(np.isfinite(values).any(axis=0), values, 0.0)  # a joint without values does not move
        for values in (windows.means["speed"], windows.means.get("position", np.empty((len(torque), 0))))
    )
    known: BoolArray = np.all(np.isfinite(np.column_stack([speed, torque, position])), axis=1)
    usual = np.quantile(np.abs(speed[known]), 0.99, axis=0) if known.any() else np.zeros(speed.shape[1])
    if not usual[j] > _HARDLY * usual.max():
        yield replace(check, found="rest")
        return
    moving = known & (np.abs(speed[:, j]) > 0.1 * usual[j])  # above 10 % of the usual largest speed
    forward = float(np.mean(speed[moving, j] > 0.0)) if moving.any() else 0.0
    both = 0.1 < forward < 0.9  # of the windows in motion
    place = _place(position, known, j, (3, 4, 5))
    mean = float(np.mean(np.abs(speed[moving, j])))
    columns = _motion_columns(windows, j, usual, both, mean)
    # Where strokes begin and end at the same places, higher powers would take the part of the inertia.
    table = np.column_stack([*columns.values(), place if both and len(usual) > 1 else _place(position, known, j)])
    used = moving & np.isfinite(table).all(axis=1)
    # At least 30 windows in motion, and three for each coefficient.
    if np.count_nonzero(used) < max(30, 3 * table.shape[1]) or not np.ptp(torque[used]):
        yield check
        return
    fit = _fit(table[used], torque[used], list(columns))
    # The sign of an inertia, and below its size (smaller by a filtered torque or a coarse speed), are weaker evidence.
    friction, inertia = _sure(fit, "friction"), _sure(fit, f"inertia {j}", 0.3)
    check = replace(check, found="unclear", value=abs(fit.value["friction"]), unit=machine.force_unit)
    share = explained(np.column_stack([place, speed[:, j]])[known], torque[known])
    # In a sine the inertia's force is a function of the place, too.
    rate = windows.rate("speed")[:, j]
    swings = known & np.isfinite(rate)
    # Above 95 % an acceleration is a function of the place. Weight and friction in one direction explain 99.95 % of a
    # torque in simulated arms.
    is_sine = explained(place[swings], rate[swings]) > 0.95
    if not is_sine and (share > 0.999999 or explained(place[known], torque[known]) > 0.99999):
        yield replace(check, answer="contradicts", found="place", share=share)
    elif not both and (machine.coupled or friction != inertia):
        yield replace(check, found="one direction")
    elif follows := [k for k in range(len(usual)) if _follows(fit, k)]:
        yield replace(check, answer="contradicts", found="other joint", other=machine.joints[follows[0]])
    # Friction that grows with the speed by 90 %, without inertia, may be a set value of the speed.
    elif not inertia and fit.value["viscous"] * mean > 0.9 * fit.value["friction"] > 0.0:
        yield replace(check, found="viscous")
    else:
        answer, found = _VERDICTS.get((friction, inertia or _sure(fit, "viscous")), ("not checked", "unclear"))
        yield replace(check, answer=answer, found=found, share=fit.errors["friction"])
    expected = float(machine.nominal_inertia[j])
    if not machine.coupled and min(friction, _sure(fit, f"inertia {j}", 0.5), expected) > 0:
        seen = fit.value[f"inertia {j}"]
        answer = "agrees" if 1.0 / _FACTOR < seen / expected < _FACTOR else "contradicts"
        unit = {"N": "kg", "N m": "kg m2"}.get(machine.force_unit, "")
        yield replace(check, check="inertia", answer=answer, found="inertia", value=seen, expected=expected, unit=unit)


def _sure(fit: _Terms, name: str, share: float = _SHARE) -> int:
    """Return the sign of a coefficient, 0 if it is not sure, not there, or too small a part of the torque."""
    # Below six standard errors it may be chance.
    if abs(fit.errors.get(name, 0.0)) < 6.0 or abs(fit.share[name]) < share:
        return 0
    return 1 if fit.value[name] > 0.0 else -1


def _follows(fit: _Terms, k: int) -> bool:
    """Whether a torque shows the friction of joint k, and at most a fifth as much of its own: a payload shows less."""
    other = fit.share.get(f"friction {k}", 0.0)
    return _sure(fit, f"friction {k}", 0.5) > 0 and abs(fit.share["friction"]) < 0.2 * other


def explained(motion: FloatArray, torque: FloatArray) -> float:
    """Return the share of a torque (w,) that positions and a speed (w, p) explain; 0 with few windows."""
    used = np.isfinite(motion).all(axis=1)
    if np.count_nonzero(used) < 10 * motion.shape[1]:  # fewer are explained by chance
        return 0.0
    table = np.column_stack([np.ones(len(motion)), motion])[used]
    rest = torque[used] - table @ np.linalg.lstsq(table, torque[used], rcond=None)[0]
    return 1.0 - float(np.var(rest) / np.var(torque[used]))


def _motion_columns(windows: Windows, j: int, usual: FloatArray, both: bool, mean: float) -> dict[str, FloatArray]:
    """Return a column of each term but the place: its name, and its value in each window (w,)."""
    speed, acceleration = windows.means["speed"], windows.rate("speed")
    moved = [k for k in range(len(usual)) if usual[k] > _HARDLY * usual.max()]
    direction, size = np.sign(speed[:, j]), np.abs(speed[:, j])
    columns = {"friction": direction, "viscous": (size - mean) * direction}
    # In one direction only, the mean is friction and weight in one.
    columns |= {"mean": np.ones(len(speed))} if both else {}
    columns |= {f"inertia {k}": acceleration[:, k] for k in moved}
    # Of another joint the sign of the speed, without a step where it turns round.
    return columns | {f"friction {k}": np.tanh(speed[:, k] / (0.05 * usual[k])) for k in moved if k != j}


def _place(position: FloatArray, known: BoolArray, j: int, powers: Sequence[int] = ()) -> FloatArray:
    """Return what stands for weight and springs, (w, p): products of positions, and further powers of the own one."""
    spread = np.std(position[known], axis=0)
    moved = np.flatnonzero(spread > 0.0)
    z = (position[:, moved] - np.mean(position[known][:, moved], axis=0)) / spread[moved]
    products = [z[:, i] * z[:, k] for i in range(len(moved)) for k in range(i + 1)]
    return np.column_stack([z, *products, *(z[:, moved == j] ** power for power in powers)])


def _fit(table: FloatArray, torque: FloatArray, names: list[str]) -> _Terms:
    """Return the coefficients by least squares without the worst windows, with errors by blocks of windows."""
    scale = np.sqrt(np.where(table.any(axis=0), np.mean(table**2, axis=0), 1.0))
    scaled, kept = table / scale, np.ones(len(torque), dtype=bool)
    for _ in range(3):
        inverse = np.linalg.pinv(scaled[kept].T @ scaled[kept])
        value = inverse @ (scaled[kept].T @ torque[kept])
        rest = np.abs(torque - scaled @ value)
        # The tenth of the windows that fits worst is left out: impacts and stiction obey other laws.
        kept = rest <= np.quantile(rest, 0.9)
    scores = scaled[kept] * (torque - scaled @ value)[kept, np.newaxis]
    # Blocks of ten windows are independent.
    blocks = np.add.reduceat(scores, np.arange(0, len(scores), 10), axis=0)
    error = np.sqrt(np.maximum(np.diag(inverse @ (blocks.T @ blocks) @ inverse), 0.0))  # rounding may be below 0
    # What the other columns leave of a column is 1 / (X'X)^-1_kk of its own sum of squares.
    alone = 1.0 / np.maximum(np.diag(inverse) * np.sum(scaled[kept] ** 2, axis=0), 1.0)
    # The other columns leave a tenth of its own unexplained.
    sure = np.where(alone > 0.1, value / np.maximum(error, 1e-12 * np.abs(value) + np.finfo(float).tiny), 0.0)
    spread = np.std(torque[kept]) or np.inf
    shares = value * np.std(scaled[kept], axis=0) / spread
    shares[0] = value[0] / spread  # its own column may be constant
    return _Terms(
        dict(zip(names, (value / scale).tolist(), strict=False)),
        dict(zip(names, sure.tolist(), strict=False)),
        dict(zip(names, shares.tolist(), strict=False)),
    )
