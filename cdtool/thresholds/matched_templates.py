"""The templates of `matched_banks`: how the start of a contact looks in each channel, whitened as the channels are."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise, product

import numpy as np

from cdtool.recording import FloatArray
from cdtool.short_repr import short_repr
from cdtool.thresholds.matched_banks_kernel import FIRST, LAST

# From this length on, the mean innovation before a template is subtracted [s].
_LONG = 0.020
# A template is evaluated that often in its length, at most at every sample.
_PER_LENGTH = 12.0
# Share of a whitened template's energy that steps have to keep, and that a column has to have.
_KEPT, _NEGLIGIBLE = 0.95, 3e-3
# A template is masked until this time after its settled phase begins [s], and this share of its length more.
SETTLING, MASKED_LENGTHS = 0.060, 1.5
# Its own recent size is that of the last this time, and so many lengths more [s]; the prior likewise [s].
_RECENT, _RECENT_LENGTHS, _PRIOR, _PRIOR_LENGTHS = 0.400, 2.0, 0.060, 0.5


@dataclass(frozen=True)
class Component:
    """A ramp (t/L)^`power` in one column; `free`: of either sign."""

    column: int
    power: float
    free: bool = False


@dataclass(frozen=True)
class Template:
    """Components that grow together over `length` [s]; of power 0: a plain sum of innovations.

    `slack`: how much larger than usual its recent size may be before it is divided by it. `reserve`: its standardised
    evidence is divided by it.
    """

    length: float
    components: tuple[Component, ...]
    slack: float
    reserve: float = 1.0


@dataclass(frozen=True)
class Bank:
    """Columns that one vector autoregression of `order` whitens, and their templates.

    `memory` [s]: over how long the mean innovation before a long template is taken. `at_start`: whether its columns
    decide before the motion is settled.
    """

    columns: tuple[int, ...]
    order: int
    templates: tuple[Template, ...]
    memory: float
    at_start: bool = True


def _milliseconds(*values: float) -> tuple[float, ...]:
    return tuple(1e-3 * value for value in values)


_SUMS = _milliseconds(4, 8, 16, 32, 64, 128, 256)
_AXIS = (
    (_milliseconds(4, 6, 8, 11, 15, 21, 30, 42), 3.0),
    (_milliseconds(42, 60, 85, 120), 2.0),
    (_milliseconds(60, 85, 120), 3.0),
)
_SHORT = _milliseconds(1, 2, 3, 4, 6, 8, 11, 15, 20, 27)
_LONG_SQUARE = _milliseconds(40, 57, 80, 110, 135)
_LONG_LINEAR = _milliseconds(60, 85, 120, 170, 230, 280)
_SLOW = ((_milliseconds(57, 80, 110), 2.0), (_milliseconds(85, 120, 170), 1.0))
# How much larger than usual the recent size of a template may be, of an axis and of joints.
_SLACK, _JOINT_SLACK = 1.15, 0.85
_WITH_FAST = _milliseconds(40, 60, 80)
# With less friction joints swing more, slowly: templates from this length on [s] keep a reserve for it.
_SWINGING, _RESERVE = 0.080, 1.2


def banks_of(kinds: Sequence[str], joints: Sequence[str], two_sided: bool, order: int | None) -> tuple[Bank, ...]:
    """Return the banks for columns of that channel and joint; `kinds` is empty for columns of unknown meaning."""
    if not kinds:
        return tuple(_sums(j, two_sided, order or 4) for j in range(len(joints)))
    if "force" in kinds:
        of_joints = [_axis_banks(kinds, joints, name, two_sided, order) for name in dict.fromkeys(joints)]
        return tuple(bank for banks in of_joints for bank in banks)
    if len(set(joints)) == 1 and "acceleration" in kinds:
        return tuple(_axis_bank(j, kind, two_sided, order or 4) for j, kind in enumerate(kinds))
    return (_joint_bank(kinds, joints, two_sided, order or 20),)


def _axis_banks(
    kinds: Sequence[str], joints: Sequence[str], name: str, two_sided: bool, order: int | None
) -> list[Bank]:
    """Return a bank each for deceleration and force of an axis, and one of its torque and speed."""
    own = [j for j, joint in enumerate(joints) if joint == name]
    banks = [_axis_bank(j, kinds[j], two_sided, order or 4) for j in own if kinds[j] in ("acceleration", "force")]
    slow = [j for j in own if kinds[j] in ("torque", "speed")]
    if "speed" in [kinds[j] for j in slow]:
        at = next(i for i, j in enumerate(slow) if kinds[j] == "speed")
        templates = tuple(
            Template(length, (Component(at, power, two_sided),), _SLACK)
            for lengths, power in _SLOW
            for length in lengths
        )
        # Before the motion is settled, another speed would look like a contact.
        banks.append(Bank(tuple(slow), order or 20, templates, 0.5, at_start=False))
    return banks


def _axis_bank(column: int, kind: str, two_sided: bool, order: int) -> Bank:
    if kind != "acceleration":
        return _sums(column, two_sided, order)
    templates = tuple(
        Template(length, (Component(0, power, two_sided),), _SLACK) for lengths, power in _AXIS for length in lengths
    )
    return Bank((column,), order, templates, 1.5)


def _sums(column: int, two_sided: bool, order: int) -> Bank:
    sums = tuple(Template(length, (Component(0, 0.0, two_sided),), _SLACK) for length in _SUMS)
    return Bank((column,), order, sums, 3.0)


def _joint_bank(kinds: Sequence[str], joints: Sequence[str], two_sided: bool, order: int) -> Bank:
    """Return the bank of all channels of several joints, or of one without acceleration."""
    at = {(kind, joint): j for j, (kind, joint) in enumerate(zip(kinds, joints, strict=True))}
    names = list(dict.fromkeys(joints))
    fast = [at["acceleration", name] for name in names if ("acceleration", name) in at]
    slow = {name: at["speed", name] for name in names if ("speed", name) in at}
    templates: list[Template] = []

    def add(length: float, components: Iterable[Component]) -> None:
        reserve = _RESERVE if length >= _SWINGING else 1.0
        templates.append(Template(length, tuple(components), _JOINT_SLACK, reserve))

    sudden, power = (fast, 2.0) if fast else (list(slow.values()), 3.0)
    for length in _SHORT:
        add(length, (Component(j, power, two_sided) for j in sudden))
    for lengths, power in ((_LONG_SQUARE, 2.0), (_LONG_LINEAR, 1.0)):
        for length, own in product(lengths, slow):
            moved = [Component(slow[own], power, two_sided)]
            moved += [Component(j, power, True) for name, j in slow.items() if name != own]
            add(length, moved)
            if length in _WITH_FAST and fast:
                add(length, [*moved, *(Component(j, power, two_sided) for j in fast)])
    return Bank(tuple(range(len(kinds))), order, tuple(templates), 0.5)


@dataclass(frozen=True)
class Design:
    """The templates of all banks at a sample period, as `evidence_of` takes them."""

    groups: np.ndarray
    first_node: np.ndarray
    lag: np.ndarray
    column: np.ndarray
    weight: FloatArray
    gain: FloatArray
    gram: FloatArray
    free: np.ndarray
    prior: FloatArray
    slack: FloatArray
    reserve: FloatArray

    __repr__ = short_repr

    @property
    def arguments(self) -> tuple[np.ndarray, ...]:
        """Return the arrays that `evidence_of` takes, in its order."""
        return (
            self.groups,
            self.first_node,
            self.lag,
            self.column,
            self.weight,
            self.gain,
            self.gram,
            self.free,
        )


def designed(
    banks: Sequence[Bank], models: Sequence[tuple[FloatArray, FloatArray]], period: float, channels: int
) -> Design:
    """Return the templates whitened by the banks' models (p, C, C) and inverse roots (C, C)."""
    groups: list[list[int]] = []
    nodes: list[tuple[int, int, float]] = []
    first_node = [0]
    gains: list[FloatArray] = []
    responses: list[FloatArray] = []
    free: list[bool] = []
    prior: list[float] = []
    slack: list[float] = []
    reserve: list[float] = []
    first_column = 0
    known: set[tuple[int, int, tuple[Component, ...]]] = set()
    for number, (bank, (model, root)) in enumerate(zip(banks, models, strict=True)):
        for template in bank.templates:
            count = max(1, round(template.length / period))
            if (number, count, template.components) in known:
                continue
            known.add((number, count, template.components))
            first = len(gains)
            for component in template.components:
                shape = whitened_template(component, count, model, root)
                steps = np.zeros((count, channels))
                steps[:, first_column : first_column + len(root)] = _in_steps(shape)
                nodes += _nodes(steps)
                first_node.append(len(nodes))
                gains.append(steps.sum(axis=0))
                responses.append(steps)
                free.append(component.free)
            long = template.length >= _LONG - 1e-9
            settled = SETTLING + MASKED_LENGTHS * template.length
            window = _RECENT + _RECENT_LENGTHS * template.length
            groups.append(
                [
                    count,
                    max(1, int(count / _PER_LENGTH)),
                    round(bank.memory / period) if long else 0,
                    max(1, round(settled / period)),
                    max(1, round(window / period)),
                    first,
                    len(gains),
                    number,
                ]
            )
            prior.append(max(1.0, (_PRIOR + _PRIOR_LENGTHS * template.length) / period))
            slack.append(template.slack)
            reserve.append(template.reserve)
        first_column += len(bank.columns)
    gram = _gram(groups, responses)
    return Design(
        np.array(groups, dtype=np.int64).T.copy(),
        np.array(first_node, dtype=np.int64),
        np.array([node[0] for node in nodes], dtype=np.int64),
        np.array([node[1] for node in nodes], dtype=np.int64),
        np.array([node[2] for node in nodes], dtype=np.float64),
        np.array(gains),
        gram,
        np.array(free, dtype=np.uint8),
        np.array(prior),
        np.array(slack),
        np.array(reserve),
    )


def _gram(groups: Sequence[Sequence[int]], responses: Sequence[FloatArray]) -> FloatArray:
    """Return the inner products (components, K) of each response with those of its group."""
    gram = np.zeros((len(responses), max(group[LAST] - group[FIRST] for group in groups)))
    for group in groups:
        own = responses[group[FIRST] : group[LAST]]
        for i, one in enumerate(own):
            for j, other in enumerate(own):
                gram[group[FIRST] + i, j] = (one * other).sum()
    return gram


def _in_steps(shape: FloatArray) -> FloatArray:
    """Return a response (L, C) as steps, columns of next to no energy as 0."""
    steps = np.zeros(shape.shape)
    for c in range(shape.shape[1]):
        if (shape[:, c] ** 2).sum() >= _NEGLIGIBLE:
            for begin, end in pairwise(_edges(shape[:, c], 1.0 - _KEPT)):
                steps[begin:end, c] = shape[begin:end, c].mean()
    return steps


def _nodes(steps: FloatArray) -> list[tuple[int, int, float]]:
    """Return lag, column and weight of the summed innovations, of which a response in steps (L, C) is the sum."""
    nodes = []
    for c in range(steps.shape[1]):
        levels = np.concatenate(([0.0], steps[:, c], [0.0]))
        changes = levels[:-1] - levels[1:]
        nodes += [(len(steps) - int(k), c, float(changes[k])) for k in np.flatnonzero(changes)]
    return nodes


def whitened_template(component: Component, count: int, model: FloatArray, root: FloatArray) -> FloatArray:
    """Return the innovations (L, C) that a component causes, with energy 1."""
    channels = len(root)
    if component.power == 0.0:
        shape = np.zeros((count, channels))
        shape[:, component.column] = 1.0
        return shape / math.sqrt(count)
    ramp = (np.arange(1, count + 1) / count) ** component.power
    raw = np.zeros((count, channels))
    raw[:, component.column] = ramp
    rest = raw.copy()
    for i in range(min(len(model), count - 1)):
        rest[i + 1 :] -= np.outer(ramp[: count - i - 1], model[i][:, component.column])
    shape = rest @ root.T
    energy = math.sqrt(float((shape**2).sum()))
    return shape / energy if energy > 0.0 else shape


def _edges(values: FloatArray, lost: float) -> list[int]:
    """Return the edges of steps that keep all but the share `lost` of the energy of values (n,)."""
    count = len(values)
    total = np.concatenate(([0.0], np.cumsum(values)))
    square = np.concatenate(([0.0], np.cumsum(values**2)))
    target = lost * square[-1]

    def best(begin: int, end: int) -> tuple[float, int]:
        if end - begin < 2:
            return 0.0, begin
        cut = np.arange(begin + 1, end)
        left, right = total[cut] - total[begin], total[end] - total[cut]
        gain = left**2 / (cut - begin) + right**2 / (end - cut) - (total[end] - total[begin]) ** 2 / (end - begin)
        at = int(np.argmax(gain))
        return float(gain[at]), int(cut[at])

    def error(begin: int, end: int) -> float:
        return float(square[end] - square[begin] - (total[end] - total[begin]) ** 2 / (end - begin))

    parts = {(0, count): best(0, count)}
    left = error(0, count)
    while left > target and len(parts) < count:
        (begin, end), (gain, cut) = max(parts.items(), key=lambda item: item[1][0])
        if gain <= 0.0:
            break
        del parts[begin, end]
        parts[begin, cut], parts[cut, end] = best(begin, cut), best(cut, end)
        left -= gain
    return sorted({0, count, *(begin for begin, _ in parts)})
