"""What `matched_banks` has learned, and how a log is compared with it: deviation, innovations, evidence."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple, Self, TypeVar

import numpy as np
import numpy.typing as npt

from cdtool.clock import previous_value
from cdtool.derived import SendsFields
from cdtool.detection import Evidence, Signal, Status, StatusArray
from cdtool.errors import NothingValidError
from cdtool.motion import MotionClass
from cdtool.recording import BoolArray, FloatArray, Recording
from cdtool.short_repr import short_repr
from cdtool.thresholds.base import exceedance
from cdtool.thresholds.fitted_signature import FittedSignature
from cdtool.thresholds.matched_banks_kernel import (
    AFTER_GAP,
    BANK,
    KNOWN,
    LENGTH,
    MASK,
    UNKNOWN,
    evidence_of,
    innovations_of,
    settled_from,
)
from cdtool.thresholds.matched_templates import SETTLING, Bank, Component, Design, Template, designed
from cdtool.thresholds.whitening import at_learned_rate, lost_in_deviation

# A location is known if at least this share of the runs, settled, has been there.
_COVERAGE = 0.7
# Steps of the mean along the stroke for which one usual size of a template holds; it is at least this share of its own
# median, and known where at least this share of the usual number of samples has been.
_PER_PLACE, _LEAST_SIZE, _ENOUGH = 10, 0.6, 0.5
# Samples that a model is learned from; more do not change it.
_MOST_SAMPLES = 200_000
_RIDGE = 1e-7
# A step longer than so many periods has lost samples in it.
_GAP = 1.5
# A motion is settled once its mean speed over the first time has changed, over the second [s], by at most this share of
# its largest change so far, and is above this share of the nominal speed.
_SHORT, _LONG, _CHANGE, _LEAST_SPEED = 0.05, 0.1, 0.15, 0.4

Item = TypeVar("Item")


class Settling(NamedTuple):
    """The sample from which a motion is settled, that at which its speed is decided, and the speed [load unit/s]."""

    start: int
    decided: int
    speed: float


@dataclass(frozen=True)
class Deviation:
    """The columns (C, n) of a log less their mean along the stroke, 0 where not `usable` (C, n).

    `gap` (n,): whether samples are lost before a sample. `start`: first sample at a known location of a settled motion;
    `place` (n,): where in the table of usual sizes; `inside` (n,): whether the location is known.
    """

    values: FloatArray
    usable: BoolArray
    gap: BoolArray
    start: int
    place: npt.NDArray[np.int64]
    inside: BoolArray

    __repr__ = short_repr

    def times(self, factor: float) -> Deviation:
        """Return the deviation times a factor."""
        return replace(self, values=factor * self.values)

    def known(self, columns: Sequence[int]) -> StatusArray:
        """Return the marks of samples (n,) for some columns: `UNKNOWN` etc. of the kernel."""
        usable = self.usable[list(columns)].all(axis=0)
        return np.where(usable, np.where(self.gap, AFTER_GAP, KNOWN), UNKNOWN).astype(np.uint8)

    def sections(self, columns: Sequence[int], scale: FloatArray) -> list[FloatArray]:
        """Return some columns in units of `scale`, (C, m) for each section without a missing sample."""
        chosen, known = list(columns), self.known(columns)
        index = np.flatnonzero(known != UNKNOWN)
        cuts = np.flatnonzero((np.diff(index) > 1) | (known[index[1:]] == AFTER_GAP)) + 1
        return [self.values[chosen][:, part] / scale[chosen, np.newaxis] for part in np.split(index, cuts)]


@dataclass(frozen=True)
class MatchedModel(SendsFields):
    """Mean along the stroke, autoregressions, templates and usual sizes, for one class of motion.

    Attributes
    ----------
    signature : FittedSignature
        Mean and spread in the start phase, with safety factor 1.
    period, step : float
        Sample period [s], and grid step along the stroke [m, rad].
    begin : int
        First grid point that is known.
    mean : ndarray of float, shape (g, C)
        Mean of each column on the grid.
    scale : ndarray of float, shape (C,)
        Standard deviation of each column about it.
    banks, models, design
        Banks, their models (p, C, C) and inverse roots of S (C, C), and the templates.
    usual : ndarray of float, shape (G, places)
        Usual size of the evidence of each template.
    learned : ndarray of float, shape (4, G)
        See `CENTRE` etc. of the kernel.
    of_banks : ndarray of float, shape (2, banks + 1)
        Mean and standard deviation of the runs' maxima of each bank and of the start phase.
    speeds : tuple of float
        Slowest and fastest settled speed to which it applies [load unit/s].
    """

    signature: FittedSignature
    period: float
    step: float
    begin: int
    mean: FloatArray
    scale: FloatArray
    banks: tuple[Bank, ...]
    models: tuple[tuple[FloatArray, FloatArray], ...]
    design: Design
    usual: FloatArray
    learned: FloatArray
    of_banks: FloatArray
    speeds: tuple[float, float]

    __repr__ = short_repr

    @classmethod
    def blank(
        cls,
        signature: FittedSignature,
        period: float,
        step: float,
        begin: int,
        mean: FloatArray,
        banks: tuple[Bank, ...],
    ) -> Self:
        """Return a model of which only the mean is learned: deviations can be computed with it."""
        nothing = np.zeros((0, 0))
        columns = mean.shape[1]
        moments = np.array([np.zeros(len(banks) + 1), np.ones(len(banks) + 1)])
        everywhere = (-math.inf, math.inf)
        models = tuple((np.zeros((1, n, n)), np.eye(n)) for n in (len(bank.columns) for bank in banks))
        design = designed(banks, models, period, columns)
        scale = np.ones(columns)
        return cls(
            signature, period, step, begin, mean, scale, banks, models, design, nothing, nothing, moments, everywhere
        )

    def with_usual(self, usual: FloatArray) -> MatchedModel:
        """Return the model with these usual sizes (G, places), and evidence that is not standardised yet."""
        groups = len(usual)
        learned = np.array([np.zeros(groups), np.ones(groups), self.design.prior, self.design.slack])
        return replace(self, usual=usual, learned=learned)

    def with_maxima(self, maxima: FloatArray) -> MatchedModel:
        """Return the model with templates standardised by the runs' maxima (runs, G)."""
        known = np.isfinite(maxima)
        number = np.maximum(known.sum(axis=0), 1)
        centre = np.where(known, maxima, 0.0).sum(axis=0) / number
        spread = np.sqrt(np.where(known, (maxima - centre) ** 2, 0.0).sum(axis=0) / number)
        # A template that ran in less than half of the runs has no known size: it never decides.
        rare = number < 0.5 * len(maxima)
        spread = np.where((spread > 0.0) & ~rare, spread * self.design.reserve, math.inf)
        return replace(self, learned=np.array([centre, spread, self.learned[2], self.learned[3]]))

    @property
    def motion(self) -> MotionClass:
        """The class of motion."""
        return self.signature.motion

    @cached_property
    def _sign(self) -> float:
        """+1 or -1: what opposes the motion becomes positive."""
        return -1.0 if self.signature.signed and self.motion.direction < 0 else 1.0

    def settled(self, recording: Recording, clock: FloatArray) -> Settling:
        """Return when the motion is settled on a clock (n,) [s], and at which speed; causal."""
        return settling(recording, clock, self.motion, self.period)

    def deviation(self, recording: Recording, signal: Signal) -> Deviation:
        """Return the deviation from the mean along the stroke, in units of `scale`, once the motion is settled."""
        travel = self.signature.progress(recording, signal.time).travel
        start = self.settled(recording, signal.time).start
        cell = travel / self.step
        with np.errstate(invalid="ignore"):
            inside = (cell >= self.begin) & (cell <= len(self.mean) - 1)
        inside[:start] = False
        start = int(np.argmax(inside)) if inside.any() else len(inside)
        cell = np.where(inside, cell, 0.0)
        low = np.minimum(cell.astype(np.int64), len(self.mean) - 2)
        share = cell - low
        usable = (signal.status == Status.VALID) & np.isfinite(signal.values) & inside[:, np.newaxis]
        lost = lost_in_deviation(self.signature, recording, signal)
        if lost is not None:
            usable &= ~lost
        values = np.zeros(signal.values.shape[::-1])
        for c in range(len(values)):
            column = self.mean[:, c]
            normal = column[low] + share * (column[low + 1] - column[low])
            deviation = self._sign / self.scale[c] * (signal.values[:, c] - normal)
            values[c] = np.where(usable[:, c], deviation, 0.0)
        place = (cell / _PER_PLACE).astype(np.int64)
        gap = np.zeros(len(signal.time), dtype=bool)
        gap[1:] = np.diff(signal.time) > _GAP * self.period
        return Deviation(values, np.ascontiguousarray(usable.T), gap, start, place, inside)

    def innovations(self, deviation: Deviation) -> FloatArray:
        """Return the innovations (C, n) of all banks, one below the other; 0 where they are not known."""
        result = np.zeros((sum(len(bank.columns) for bank in self.banks), deviation.values.shape[1]))
        first = 0
        for bank, (model, root) in zip(self.banks, self.models, strict=True):
            columns = list(bank.columns)
            known = deviation.known(columns)
            innovations_of(np.ascontiguousarray(deviation.values[columns]), known, model, root, first, result)
            first += len(columns)
        return result

    def sizes(self, deviation: Deviation) -> FloatArray:
        """Return Z (G, n) of each template, NaN where it does not run: not in units of its usual size."""
        return self._evidence(deviation, 0)

    def evidence(self, recording: Recording, signal: Signal, factor: float = 1.0) -> FloatArray:
        """Return the standardised evidence (G, n) of each template; `factor` multiplies the deviation."""
        return self._evidence(self.deviation(recording, signal).times(factor), 1)

    def _evidence(self, deviation: Deviation, mode: int, by_bank: bool = False) -> FloatArray:
        """Return the evidence of each template, or the largest of each bank; `mode` 0: not standardised."""
        innovations = self.innovations(deviation)
        total = np.zeros((len(innovations), innovations.shape[1] + 1))
        np.cumsum(innovations, axis=1, out=total[:, 1:])
        design = self.design
        groups = design.groups.shape[1]
        rows = design.groups[BANK] if by_bank else np.arange(groups)
        result = np.full((int(rows.max()) + 1, innovations.shape[1]), np.nan)
        tables = (self.usual, self.learned) if mode else (np.ones((1, 1)), np.ones((4, groups)))
        where = deviation.place, deviation.start
        evidence_of(total, *design.arguments, *tables, *where, mode, np.ascontiguousarray(rows), result)
        result[:, ~deviation.inside] = np.nan
        return result

    def by_bank(self, recording: Recording, signal: Signal, factor: float = 1.0) -> FloatArray:
        """Return the evidence (banks + 1, n) of each bank and of the start phase, NaN where they do not run."""
        return self._by_bank(recording, signal, self.deviation(recording, signal).times(factor))

    def _by_bank(self, recording: Recording, signal: Signal, deviation: Deviation) -> FloatArray:
        result = np.empty((len(self.banks) + 1, len(signal.time)))
        result[:-1] = self._evidence(deviation, 1, by_bank=True)
        early = slice(0, deviation.start + int(self.design.groups[MASK].min()))
        statistic, met = exceedance(self.signature, recording, signal.part(early))
        met = np.where(statistic.status == Status.VALID, met, -np.inf)
        start = np.full(len(signal.time), -np.inf)
        for bank in self.banks:
            for column in bank.columns if bank.at_start else ():
                np.maximum(start[early], met[:, column], out=start[early])
        result[-1] = np.where(np.isfinite(start), start, np.nan)
        return result

    def standardised(self, recording: Recording, signal: Signal) -> tuple[FloatArray, StatusArray]:
        """Return the standardised evidence (banks + 1, n), and the status (n,) of the whole machine.

        A sample without evidence is VALID in this status; see `FittedMatchedBanks.evaluate`.
        """
        result = self._by_bank(recording, signal, self.deviation(recording, signal))
        result -= self.of_banks[0][:, np.newaxis]
        result /= self.of_banks[1][:, np.newaxis]
        nowhere, missing = np.ones(len(signal.time), dtype=bool), np.zeros(len(signal.time), dtype=bool)
        highest = np.zeros(len(signal.time), dtype=np.uint8)
        for c in range(signal.values.shape[1]):
            own = signal.status[:, c]
            valid = own == Status.VALID
            nowhere &= ~valid
            missing |= (own == Status.GAP) | (valid & ~np.isfinite(signal.values[:, c]))
            np.maximum(highest, own, out=highest)
        status = np.where(nowhere, highest, np.uint8(Status.VALID)).astype(np.uint8)
        status[missing] = Status.GAP
        lost = lost_in_deviation(self.signature, recording, signal)
        if lost is not None:
            status[lost.any(axis=1) & (status == Status.VALID)] = Status.GAP
        _, decided, speed = self.settled(recording, signal.time)
        if not self.speeds[0] <= speed <= self.speeds[1]:
            status[decided:][status[decided:] == Status.VALID] = Status.OTHER_SPEED
        status[~at_learned_rate(signal.time, self.period) & (status == Status.VALID)] = Status.OTHER_RATE
        return result, status

    def explained(self, recording: Recording, signal: Signal, time: float) -> Evidence | None:
        """Return which bank, template and columns decide at a time [s]; None where nothing is assessable."""
        at = int(np.searchsorted(signal.time, time, side="right")) - 1
        deviation = self.deviation(recording, signal)
        banks = self._by_bank(recording, signal, deviation)
        now = (banks[:, at] - self.of_banks[0]) / self.of_banks[1] if at >= 0 else np.array([np.nan])
        if np.isnan(now).all():
            return None
        bank = int(np.nanargmax(now))
        if bank == len(self.banks):
            return Evidence((), 0.0, ())
        own = np.where(self.design.groups[BANK] == bank, self._evidence(deviation, 1)[:, at], np.nan)
        group = int(np.nanargmax(own))
        length = int(self.design.groups[LENGTH, group])
        names = signal.joints or recording.joints
        first = sum(len(item.columns) for item in self.banks[:bank])
        innovations = self.innovations(deviation)[first : first + len(self.banks[bank].columns)]
        sums = innovations[:, max(0, at + 1 - length) : at + 1].sum(axis=1) / math.sqrt(length)
        columns = tuple(names[c] for c in self.banks[bank].columns)
        return Evidence(columns, length * self.period, tuple(sums.tolist()))

    def to_dict(self) -> dict[str, Any]:
        """Return the model as JSON values."""
        rare = np.isinf(self.learned[1])
        return {
            "signature": self.signature.to_dict(),
            "period": self.period,
            "step": self.step,
            "begin": self.begin,
            "mean": self.mean.tolist(),
            "scale": self.scale.tolist(),
            "banks": [_bank_to_dict(bank) for bank in self.banks],
            "models": [{"model": model.tolist(), "root": root.tolist()} for model, root in self.models],
            "usual": self.usual.tolist(),
            "centre": self.learned[0].tolist(),
            "spread": np.where(rare, 0.0, self.learned[1]).tolist(),
            "of_banks": self.of_banks.tolist(),
            "speeds": list(self.speeds),
        }

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Return the model that `to_dict` has written."""
        banks = tuple(_bank_from_dict(item) for item in values["banks"])
        models = tuple((np.array(item["model"]), np.array(item["root"])) for item in values["models"])
        scale, period = np.array(values["scale"]), float(values["period"])
        design = designed(banks, models, period, len(scale))
        spread = np.array(values["spread"])
        spread[spread == 0.0] = math.inf
        return cls(
            signature=FittedSignature.from_dict(values["signature"]),
            period=period,
            step=float(values["step"]),
            begin=int(values["begin"]),
            mean=np.array(values["mean"]),
            scale=scale,
            banks=banks,
            models=models,
            design=design,
            usual=np.array(values["usual"]),
            learned=np.array([np.array(values["centre"]), spread, design.prior, design.slack]),
            of_banks=np.array(values["of_banks"]),
            speeds=(float(values["speeds"][0]), float(values["speeds"][1])),
        )


def _bank_to_dict(bank: Bank) -> dict[str, Any]:
    templates = [
        {
            "length": item.length,
            "components": [[part.column, part.power, part.free] for part in item.components],
            "slack": item.slack,
            "reserve": item.reserve,
        }
        for item in bank.templates
    ]
    return {
        "columns": list(bank.columns),
        "order": bank.order,
        "memory": bank.memory,
        "at_start": bank.at_start,
        "templates": templates,
    }


def _bank_from_dict(values: Mapping[str, Any]) -> Bank:
    templates = tuple(
        Template(
            float(item["length"]),
            tuple(Component(int(a), float(b), bool(c)) for a, b, c in item["components"]),
            float(item["slack"]),
            float(item["reserve"]),
        )
        for item in values["templates"]
    )
    columns = tuple(int(column) for column in values["columns"])
    return Bank(columns, int(values["order"]), templates, float(values["memory"]), bool(values["at_start"]))


def settling(recording: Recording, clock: FloatArray, motion: MotionClass, period: float) -> Settling:
    """Return from which sample of a clock (n,) [s] a motion is settled, and its mean speed about then; causal.

    Parameters
    ----------
    recording : Recording
        A recording with a speed.
    clock : ndarray of float, shape (n,)
        Times of the samples [s].
    motion : MotionClass
        Direction, joint and nominal speed.
    period : float
        Sample period [s].

    Returns
    -------
    Settling
        Samples are n if the motion is not settled, the speed is then NaN.
    """
    speed = motion.direction * previous_value(recording["speed"], clock)[:, motion.joint]
    known = np.maximum.accumulate(np.where(np.isfinite(speed), np.arange(len(speed)), -1))
    speed = np.ascontiguousarray(np.where(known >= 0, speed[known], 0.0))
    short, long, least = round(_SHORT / period), round(_LONG / period), _LEAST_SPEED * motion.nominal_speed
    start = int(settled_from(speed, max(1, short), max(1, long), _CHANGE, least))
    decided = start + round(SETTLING / period)
    if decided >= len(clock):
        return Settling(start, len(clock), math.nan)
    since = max(0, start - round(1.5 * SETTLING / period))
    return Settling(start, decided, float(speed[since : decided + 1].mean()))


def average_along_stroke(
    pairs: Sequence[tuple[Recording, Signal]], signature: FittedSignature, period: float, step: float
) -> tuple[int, FloatArray]:
    """Return the first known grid point, and the mean (g, C) of each column along the stroke of settled runs."""
    motion, columns = signature.motion, pairs[0][1].values.shape[1]
    travels = [signature.progress(recording, signal.time).travel for recording, signal in pairs]
    cells = int(max(float(np.nanmax(travel, initial=0.0)) for travel in travels) / step) + 2
    total, count, runs = np.zeros((cells, columns)), np.zeros((cells, columns)), np.zeros(cells)
    for (recording, signal), travel in zip(pairs, travels, strict=True):
        use = np.isfinite(travel)
        use[: settling(recording, signal.time, motion, period).start] = False
        cell = np.rint(travel[use] / step).astype(np.int64)
        runs[np.unique(cell)] += 1
        for c in range(columns):
            ok = (signal.status[use, c] == Status.VALID) & np.isfinite(signal.values[use, c])
            total[:, c] += np.bincount(cell[ok], signal.values[use, c][ok], cells)
            count[:, c] += np.bincount(cell[ok], minlength=cells)
    known = np.flatnonzero(runs >= _COVERAGE * len(pairs))
    if len(known) < 2:
        raise NothingValidError(
            "the motion is not settled long enough in the runs: no section at constant speed that they share",
            "longer runs at constant speed, or another detector",
        )
    begin, last = int(known[0]), int(known[-1]) + 1
    mean = np.empty((last, columns))
    for c in range(columns):
        at = begin + np.flatnonzero(count[begin:last, c] > 0.0)
        if not len(at):
            raise NothingValidError(
                "a column of the signal is nowhere valid once the motion is settled", "another detector"
            )
        mean[:, c] = np.interp(np.arange(last), at, total[at, c] / count[at, c])
    return begin, mean


def fit_autoregression(sections: Sequence[FloatArray], order: int) -> tuple[FloatArray, FloatArray]:
    """Return model (p, C, C) and inverse square root (C, C) of the innovations' covariance, by least squares.

    Parameters
    ----------
    sections : sequence of ndarray of float
        Deviations (C, m) without a missing sample, of several runs.
    order : int
        Number p of samples before that predict one.

    Returns
    -------
    model : ndarray of float, shape (p, C, C)
        The deviation i samples before is multiplied by `model[i - 1]`.
    root : ndarray of float, shape (C, C)
        S^(-1/2): with it the innovations have spread 1 and are not correlated.

    Raises
    ------
    NothingValidError
        No section is long enough, or the columns depend on each other exactly.

    Notes
    -----
    Covariance method: least squares over all sections, with a ridge of 1e-7. Not Yule-Walker, whose windowing makes
    limits of smooth signals many times too high.

    Examples
    --------
    >>> rng = np.random.default_rng(1)
    >>> noise, values = rng.normal(size=5000), np.zeros(5000)
    >>> for k in range(2, 5000):
    ...     values[k] = 1.5 * values[k - 1] - 0.7 * values[k - 2] + 2.0 * noise[k]
    >>> model, root = fit_autoregression([values[np.newaxis]], 2)
    >>> model[:, 0, 0].round(1).tolist(), root.round(1).tolist()
    ([1.5, -0.7], [[0.5]])
    """
    columns = len(sections[0])
    size = order * columns
    # Products of each sample with the one j before it, summed, and what the ends of the sections add to them.
    lagged, number = np.zeros((order + 1, columns, columns)), 0
    begins, ends = [], []
    for section in sections:
        if number > _MOST_SAMPLES:
            break
        long = section.shape[1]
        if long <= order:
            continue
        for lag in range(order + 1):
            lagged[lag] += section[:, order:] @ section[:, order - lag : long - lag].T
        begins.append(section[:, order - 1 :: -1].T[:order].ravel())
        ends.append(section[:, : long - order - 1 : -1].T.ravel())
        number += long - order
    if number <= size:
        raise NothingValidError(
            f"{number} samples in sections of more than {order}: too few for the model", "add runs, or a smaller order"
        )
    products = _all_products(lagged, np.array(begins), np.array(ends))
    outer, cross, inner = products[:columns, :columns], products[columns:, :columns], products[columns:, columns:]
    inner, cross, outer = inner / number + _RIDGE * np.eye(size), cross / number, outer / number
    solution = np.linalg.solve(inner, cross)
    covariance = outer - solution.T @ cross - cross.T @ solution + solution.T @ inner @ solution
    sizes, axes = np.linalg.eigh(covariance)
    if not sizes[0] > 0.0:
        raise NothingValidError("columns of the signal depend on each other exactly", "leave one of the channels out")
    root = (axes / np.sqrt(sizes)) @ axes.T
    model = np.ascontiguousarray(solution.reshape(order, columns, columns).transpose(0, 2, 1))
    return model, np.ascontiguousarray(root)


def _all_products(lagged: FloatArray, begins: FloatArray, ends: FloatArray) -> FloatArray:
    """Return the sums over k of y_{k-i} y_{k-j}' in blocks (i, j) from 0 to p, of those with i = 0: `lagged`.

    S(i+1, j+1) is S(i, j), one sample earlier: with the first sample of each section more, and the last one less.
    `begins` and `ends` (sections, p C): the first p samples of each section, and the last p, each the latest first.
    """
    blocks, columns = len(lagged), lagged.shape[1]
    edge = begins.T @ begins - ends.T @ ends
    products = np.empty((blocks * columns, blocks * columns))
    for i in range(blocks):
        rows = slice(i * columns, (i + 1) * columns)
        products[rows, :columns] = lagged[i].T
        if i == 0:
            products[rows] = np.hstack(list(lagged))
        else:
            before = slice((i - 1) * columns, i * columns)
            products[rows, columns:] = products[before, :-columns] + edge[before]
    return products


def usual_sizes(model: MatchedModel, pairs: Sequence[tuple[Recording, Signal]], factor: float) -> FloatArray:
    """Return the root mean square (G, places) of the evidence of each template along the stroke."""
    groups, places = model.design.groups.shape[1], (len(model.mean) - 1) // _PER_PLACE + 1
    squares, number = np.zeros((groups, places)), np.zeros((groups, places))
    for recording, signal in pairs:
        deviation = model.deviation(recording, signal).times(factor)
        sizes = model.sizes(deviation)
        for g in range(groups):
            ok = np.isfinite(sizes[g])
            squares[g] += np.bincount(deviation.place[ok], sizes[g, ok] ** 2, places)
            number[g] += np.bincount(deviation.place[ok], minlength=places)
    usual = np.ones((groups, places))
    for g in range(groups):
        if not number[g].any():
            continue
        known = np.flatnonzero(number[g] >= _ENOUGH * np.median(number[g][number[g] > 0]))
        usual[g] = np.interp(np.arange(places), known, np.sqrt(squares[g, known] / number[g, known]))
        median = float(np.median(usual[g]))
        usual[g] = np.maximum(usual[g], _LEAST_SIZE * median) if median > 0.0 else 1.0
    return usual


def spread_evenly(items: Sequence[Item], most: int) -> list[Item]:
    """Return at most that many of the items, evenly spread.

    Examples
    --------
    >>> spread_evenly(range(10), 4)
    [0, 2, 5, 7]
    """
    if len(items) <= most:
        return list(items)
    return [items[i * len(items) // most] for i in range(most)]
