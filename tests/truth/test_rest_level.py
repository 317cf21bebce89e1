"""The rest level against the same rule written line by line."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from cdtool.truth.rest_level import RunningRest, rest_before

# Readings of a quiet, a coarse and a drifting cell with contacts, and nonsense.
_LEVELS = st.sampled_from([0.0, -0.0, 0.5, 1.0, -3.0, 150.0, 1e-300, 1e150])


@st.composite
def cells(draw):
    """Times (n,) [s] and readings (n,) [N], none missing."""
    count = draw(st.sampled_from([1, 2, 3, 4, 7, 30, 90, 400, 1600]))
    step = draw(st.sampled_from([1e-3, 0.004, 0.01, 0.06]))
    random = np.random.default_rng(draw(st.integers(0, 2**31)))
    steps = np.full(count, step)
    if draw(st.booleans()):
        steps *= random.uniform(0.2, 1.8, count)
    if draw(st.booleans()):
        steps[random.integers(0, count, 3)] = draw(st.sampled_from([0.05, 0.3, 2.0, 30.0]))
    time = draw(st.sampled_from([0.0, -2.0, 1.7e9])) + np.cumsum(steps)
    force = draw(_LEVELS) + draw(st.sampled_from([0.0, 1e-6, 0.3])) * random.normal(size=count)
    force = force + draw(st.sampled_from([0.0, 4.0, -30.0])) * (time - time[0])
    for begin in random.integers(0, count, draw(st.integers(0, 3))):
        force[begin : begin + count // 8] += draw(_LEVELS)
    if draw(st.booleans()):
        force = np.round(force / 0.5) * 0.5
    return time, force


@settings(max_examples=150, deadline=None)
@given(cells(), st.data())
def test_levels_lines_and_noise_are_those_of_the_rule(cell, data):
    time, force = cell

    def assert_same(found, expected):
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * np.max(np.abs(force)))

    ours, theirs = RunningRest(time, force), _Rest(time, force)
    moments = st.floats(-0.5, 1.5).map(lambda share: float(time[0] + share * (time[-1] - time[0])))
    for _ in range(data.draw(st.integers(0, 3))):
        assert_same(ours.levels, theirs.levels)
        assert_same(np.array(ours.start), np.array(theirs.start))
        for gap in (0.3, 0.05):
            at = data.draw(moments)
            line = ours.line(at, gap)
            assert_same(np.array(line), np.array(theirs.line(at, gap)))
            assert_same(line.value(time), theirs.value(np.array(line), time))
        start, end = sorted((data.draw(moments), data.draw(moments)))
        if end < time[0]:
            continue
        level = data.draw(st.sampled_from([None, 2.5]))
        ours.exclude(start, end, level)
        theirs.exclude(start, end, level)
    assert_same(ours.levels, theirs.levels)
    assert_same(np.array(ours.noise), np.array(theirs.noise))  # not that about the changed levels
    onset = data.draw(moments)
    line = _Rest(time, force).line(onset, 0.3)
    assert_same(np.array(rest_before(time, force, onset)), _Rest.value(np.array(line), np.array(onset)))


class _Rest:
    """The rule of `RunningRest`, with numpy on whole arrays."""

    def __init__(self, time, force):
        self.time = time
        number = np.floor((time - time[0]) / 0.05).astype(np.int64)
        self.first = np.flatnonzero(np.concatenate(([True], np.diff(number) > 0)))
        self.ends = time[np.concatenate((self.first[1:], [len(time)])) - 1]
        self.own = np.cumsum(np.concatenate(([0], np.diff(number) > 0)))
        self.median = self.by_interval(force)
        self.centre = 0.5 * (time[self.first] + self.ends)
        self.rest = np.ones(len(self.first), dtype=bool)
        count = max(3, int(np.searchsorted(time, time[0] + 0.1)))
        part = force[:count]
        self.start = float(np.median(part))
        spread = 1.4826 * float(np.median(np.abs(part - np.median(part))))
        self.start_error = 1.2533 * spread / np.sqrt(min(count, len(force)))
        lines = [self.fitted(float(begin), 0.3)[0] for begin in time[self.first]]
        self.lines = np.array(lines).T
        self.levels = self.value(self.lines[:, self.own], time)
        deviations = self.by_interval(np.abs(force - self.levels))
        quiet = deviations <= 3.0 * float(np.quantile(deviations, 1.0 / 3.0))
        self.noise = 1.4826 * float(np.median(deviations[quiet]))

    def by_interval(self, values):
        parts = (np.sort(values[self.own == i]) for i in range(len(self.first)))
        return np.array([0.5 * (part[(len(part) - 1) // 2] + part[len(part) // 2]) for part in parts])

    @staticmethod
    def value(line, time):
        return line[0] + line[1] * (time - line[2])

    def fitted(self, before, gap):
        """The line for a time, not yet held after its last interval, and when that ended."""
        rest = np.flatnonzero(self.rest)
        known = rest[: np.searchsorted(self.ends[rest], before - gap, side="right")][-20:]
        if len(known) < 2:
            return [self.start, 0.0, float(self.time[0]), self.start_error, 0.0], np.inf
        return _line(self.centre[known], self.median[known]), float(self.ends[known[-1]])

    def line(self, before, gap):
        line, last = self.fitted(before, gap)
        if before - last <= 1.0:
            return line
        level = float(self.value(line, np.array([last]))[0])
        return [level, 0.0, last, float(np.hypot(line[3], line[4] * (last - line[2]))), line[4]]

    def exclude(self, start, end, level):
        first = self.own[min(int(np.searchsorted(self.time, start)), len(self.time) - 1)]
        last = self.own[np.searchsorted(self.time, end, side="right") - 1]
        self.rest[first : last + 1] = False
        if level is not None:
            self.start = level
        later = np.flatnonzero(self.rest[last + 1 :]) + last + 1
        until = later[20] if len(later) > 20 else len(self.first) - 1
        begins = self.time[self.first]
        stop = int(np.searchsorted(begins, self.ends[until] + 0.3, side="right"))
        for i in range(first, min(stop + 1, len(self.first))):
            self.lines[:, i] = self.line(float(begins[i]), 0.3)
        part = slice(self.first[first], None)
        self.levels[part] = self.value(self.lines[:, self.own[part]], self.time[part])


def _line(time, values):
    """Theil-Sen line through a window, or its median where it does not clearly drift."""
    size, at, level = len(time), time.mean(), np.median(values)
    spread = 1.4826 * np.median(np.abs(values - level))
    drift = drift_error = 0.0
    if size >= 6:
        a, b = np.triu_indices(size, 1)
        slope = np.median((values[b] - values[a]) / (time[b] - time[a]))
        left = values - slope * (time - at)
        middle = np.median(left)
        about = 1.4826 * np.median(np.abs(left - middle))
        drift_error = about / np.sqrt(np.sum((time - at) ** 2))
        if abs(slope) > 3.0 * (1.0 + 10.0 / size) * drift_error:
            drift, level, spread = slope, middle, about
    return [float(level), float(drift), float(at), float(1.2533 * spread / np.sqrt(size)), float(drift_error)]
