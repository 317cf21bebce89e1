"""Values that no sensor of a machine measures: fill values, integer overflow, spikes. Masked, counted, and a loss.

`IMPOSSIBLE` applies to every channel. Other plausible ranges are learned from impact-free runs and stored with them; a
log is compared with these, sample by sample, and never with its own later samples: a log that is learned from and
scored is compared with the ranges of others (`LearnedRanges`). Ranges are of channels as logged, in SI, before anything
is derived from them.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from itertools import pairwise
from typing import Any, Self

import numpy as np

from cdtool.base.arrays import BoolArray, FloatArray
from cdtool.base.findings import Finding
from cdtool.recordings.recording import MEASURED, REFERENCES, Recording, Series

# No channel of a machine reaches this value in SI: 1e9 N m, rad/s or rad.
IMPOSSIBLE = 1e9
# Above this multiple of the reach (the distance from the median of 99 % of the samples) a value is not a measurement.
# Stiff impacts reach 13 in this project's logs; accelerometers measure shocks, and encoders may start elsewhere.
FAR = {"acceleration": 1e4, "position": 1e4, "reference_position": 1e4}
# Ends of integer ranges, as logged before scaling.
_ENDS = np.array([-(2.0**15), 2.0**15 - 1, 2.0**16 - 1, -(2.0**31), 2.0**31 - 1, 2.0**32 - 1])
#: An end of a range beyond this multiple of the reach fills a gap.
_FAR_ENDS = 20.0
# In runs to learn from, a value above this multiple of the runs' largest distance, for so few samples, is a spike. In a
# log to be assessed it may be a contact.
_SPIKE, _SPIKE_SAMPLES = {"acceleration": 20.0}, 3
# A log may begin with wrong values for at most this many samples.
_EDGE = 3
# Ranges without a log are learned at most so many times, each time without a part of the logs.
_FOLDS = 10

# Beside the channels' ranges in a file.
_CHECKS = "contradicted"

_VALUES = "Array(float64, 2, 'C', readonly=True)"


@dataclass(frozen=True)
class ChannelRange:
    """A channel's median for each joint, its reach about it (that of the joint with the largest), and its rate.

    `rate` [unit/s] is the largest rate of change, 0 if not checked. `extreme` is a run's largest distance from the
    median, 0 if unknown: a log mostly at rest has a small reach and a large distance.
    """

    unit: str
    centre: tuple[float, ...]
    reach: float
    rate: float = 0.0
    extreme: float = 0.0


@dataclass(frozen=True)
class PlausibleRanges:
    """The plausible values of each channel, and the checks of channels that contradict the machine file."""

    channels: Mapping[str, ChannelRange]
    contradicted: tuple[Finding, ...] = ()

    @classmethod
    def learned(cls, recordings: Sequence[Recording]) -> Self:
        """Learn the ranges of impact-free runs as logged; up to a fifth of the runs may be wrong without effect."""
        found: dict[str, ChannelRange] = {}
        for name in (*MEASURED, *REFERENCES):
            series = [item[name] for item in recordings if name in item]
            alike = [
                item for item in series if (item.unit, item.joint_count) == (series[0].unit, series[0].joint_count)
            ]
            learned = _learned(alike, name.endswith("position")) if alike else None
            if learned is not None:
                found[name] = learned
        return cls(found)

    def masked(
        self,
        recording: Recording,
        factors: Mapping[str, Sequence[float]],
        *,
        to_learn: tuple[float, float] | None = None,
    ) -> Recording:
        """Return the recording without implausible values, and a loss for each joint with such values.

        `factors` convert a channel's logged numbers to SI, per joint. `to_learn`: start and end [s] of a section
        without a contact, whose spikes are masked too; None: the log is assessed.
        """
        recording = recording if to_learn else self.without_contradicted(recording)
        channels, findings = dict(recording.channels), list(recording.findings)
        for name, known in self.channels.items():
            if name not in recording:
                continue
            series = recording[name]
            if (series.unit, series.joint_count) != (known.unit, len(known.centre)):
                findings.append(Finding("learned_in_other_unit", name, {"logged": series.unit, "learned": known.unit}))
                continue
            of_channel = factors.get(name, ())
            far = FAR.get(name, 1e3)
            if not to_learn and _is_ordinary(series, known):
                continue
            wrong = _implausible(series, known, far, of_channel)
            if to_learn and not name.endswith("position"):
                spikes = _spikes(np.where(wrong, np.nan, series.values), known, _SPIKE.get(name, 5.0))
                wrong |= spikes & ((to_learn[0] <= series.time) & (series.time <= to_learn[1]))[:, np.newaxis]
            values = np.where(wrong, np.nan, series.values)
            for j in range(series.joint_count):
                joint = recording.joints[j] if series.joint_count > 1 else ""
                factor = of_channel[j] if of_channel else 0.0
                behind, leaps = _leapt(series.time, values[:, j], known, known.centre[j], factor)
                if wrong[:, j].any():
                    numbers = _far_values(series, j, wrong[:, j], known, joint)
                    findings.append(Finding("implausible_values", name, numbers))
                if behind.any():
                    masked = int(np.count_nonzero(behind))
                    findings.append(
                        Finding(
                            "leaping_values",
                            name,
                            {"count": masked, "joint": joint, "leaps": tuple(leaps), "unit": series.unit},
                        )
                    )
                values[behind, j] = np.nan
            if wrong.any() or not np.array_equal(values, series.values, equal_nan=True):
                channels[name] = Series(series.time, values, series.unit)
        return replace(recording, channels=channels, findings=tuple(findings))

    def contradicted_by(self, checks: Iterable[Finding]) -> PlausibleRanges:
        """Return the ranges with the checks that are contradictions."""
        lost = (item for item in checks if item.severity == "loss")
        return replace(self, contradicted=tuple(item for item in lost if item.kind == "channel_check"))

    def without_contradicted(self, recording: Recording) -> Recording:
        """Return the recording without values of the channels that a check contradicts, and a loss for each."""
        checks = [check for check in self.contradicted if check.channel in recording]
        channels = dict(recording.channels)
        for check in checks:
            series = channels[check.channel]
            wrong = np.array([check.numbers["joint"] in ("", joint) for joint in recording.joints])
            channels[check.channel] = series.with_values(np.where(wrong, np.nan, series.values), series.unit)
        return replace(recording, channels=channels, findings=(*recording.findings, *checks)) if checks else recording

    def to_dict(self) -> dict[str, Any]:
        """Return the ranges as JSON values."""
        checks = {_CHECKS: [dict(item.numbers) for item in self.contradicted]} if self.contradicted else {}
        return {name: asdict(item) for name, item in self.channels.items()} | checks

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Return the ranges from JSON values; raises KeyError, TypeError or ValueError for anything else."""
        channels = {
            str(name): ChannelRange(
                str(item["unit"]),
                tuple(map(float, item["centre"])),
                float(item["reach"]),
                float(item["rate"]),
                float(item.get("extreme", 0.0)),
            )
            for name, item in values.items()
            if name != _CHECKS
        }
        for name, item in channels.items():
            figures = [*item.centre, item.reach, item.rate, item.extreme]
            if not (np.isfinite(figures).all() and item.reach > 0.0 <= min(item.rate, item.extreme)):
                raise ValueError(f"a plausible range of {name} with reach {item.reach:g} and rate {item.rate:g}")
        checks = [Finding("channel_check", item["channel"], item, "loss") for item in values.get(_CHECKS, ())]
        return cls(channels, tuple(checks))


@dataclass(frozen=True)
class LearnedRanges:
    """The plausible ranges of all runs, and for runs that are scored too, those of other runs only, by name."""

    all: PlausibleRanges
    by_name: Mapping[str, PlausibleRanges] = field(default_factory=dict)

    @classmethod
    def of(cls, runs: Mapping[str, Recording], scored: Collection[str]) -> Self:
        """Learn from runs by name as logged; `scored` are the names of those that are compared with ranges themselves.

        With more than 10 runs, ranges are learned 10 times, each time without a tenth of them.
        """
        own = [name for name in runs if name in scored]
        by_name: dict[str, PlausibleRanges] = {}
        for fold in range(min(_FOLDS, len(own))):
            left_out = own[fold::_FOLDS]
            ranges = PlausibleRanges.learned([item for name, item in runs.items() if name not in left_out])
            by_name |= dict.fromkeys(left_out, ranges)
        return cls(PlausibleRanges.learned(list(runs.values())), by_name)

    def without(self, name: str) -> PlausibleRanges:
        """Return the ranges that a log is compared with: of a log that was learned from, those of others."""
        return self.by_name.get(name, self.all)


def _learned(series: Sequence[Series], moves: bool) -> ChannelRange | None:
    """Return one channel's range; None if no run has a value, or all values are equal."""
    medians = [np.array([_quantile(column, 0.5) for column in item.values.T]) for item in series]
    medians = [median for median in medians if np.isfinite(median).all()]
    if not medians:
        return None
    centre = np.median(np.array(medians), axis=0)
    # One sample in a hundred, and one run in five, may be wrong without affecting a range.
    reach = _of_most([max(_quantile(column, 0.99) for column in np.abs(item.values - centre).T) for item in series])
    rate = _of_most([_rate(item) for item in series]) if moves else 0.0
    extreme = _of_most([_extreme(item.values - centre) for item in series])
    return ChannelRange(series[0].unit, tuple(centre.tolist()), reach, rate, extreme) if reach > 0.0 else None


def _extreme(off: FloatArray) -> float:
    """Return a run's largest distance, over joints, ignoring as many samples as a spike has."""
    furthest = 0.0
    for column in np.abs(off).T:
        known = np.sort(column[np.isfinite(column)])
        if len(known):
            furthest = max(furthest, float(known[max(len(known) - 1 - _SPIKE_SAMPLES, 0)]))
    return furthest


def _rate(series: Series) -> float:
    if len(series) < 2:
        return 0.0
    rates = np.abs(np.diff(series.values, axis=0)) / np.diff(series.time)[:, np.newaxis]
    return max(_quantile(column, 0.99) for column in rates.T)


def _of_most(figures: Sequence[float]) -> float:
    """Return the largest of the lowest four fifths of the runs; 0 without runs."""
    known = sorted(figure for figure in figures if np.isfinite(figure))
    return known[int(0.8 * (len(known) - 1))] if known else 0.0


def _quantile(values: FloatArray, share: float) -> float:
    finite = values[np.isfinite(values)]
    if not len(finite):
        return float("nan")
    place = int(share * (len(finite) - 1))
    return float(np.partition(finite, place)[place])


def _implausible(series: Series, known: ChannelRange, far: float, factors: Sequence[float]) -> BoolArray:
    """Return True (n, J) where a value is far from all learned values, or an end of an integer range."""
    with np.errstate(invalid="ignore"):
        distance = np.abs(series.values - np.array(known.centre))
        # ... and above ten times the largest distance in the runs.
        wrong: BoolArray = distance > max(far * known.reach, 10.0 * known.extreme)
        for j, factor in enumerate(factors):
            ends = np.isin(series.values[:, j], _ENDS * factor)
            wrong[:, j] |= ends & (distance[:, j] > _FAR_ENDS * known.reach)
    return wrong


def _is_ordinary(series: Series, known: ChannelRange) -> bool:
    """Return True only if no value can be implausible and no step a leap: a quick look, as most channels have neither.

    Near the centre neither an end of a range nor a step from one end to the other is possible.
    """
    with np.errstate(invalid="ignore"):
        distance = np.abs(series.values - np.array(known.centre))
        is_near = distance <= _FAR_ENDS * known.reach  # below every FAR
        steps = np.abs(np.diff(series.values, axis=0)) if known.rate > 0.0 else np.empty(0)
        return bool(is_near.all() and (steps <= known.reach).all())


def _spikes(values: FloatArray, known: ChannelRange, far: float) -> BoolArray:
    """Return True (n, J) where values exceed `far` times the runs' largest distance, for few samples."""
    spikes = np.zeros(values.shape, dtype=bool)
    if known.extreme <= 0.0:
        return spikes
    with np.errstate(invalid="ignore"):
        beyond = np.abs(values - np.array(known.centre)) > far * known.extreme
    for j in np.flatnonzero(beyond.any(axis=0)).tolist():
        edges = np.flatnonzero(np.diff(np.concatenate(([False], beyond[:, j], [False])).astype(np.int8)))
        for first, last in edges.reshape(-1, 2).tolist():
            spikes[first:last, j] = last - first <= _SPIKE_SAMPLES
    return spikes


def _leapt(
    time: FloatArray, values: FloatArray, known: ChannelRange, centre: float, factor: float
) -> tuple[BoolArray, list[dict[str, Any]]]:
    """Return True (n,) for the values of a joint after a leap, and its leaps: steps impossible for the machine."""
    index = np.flatnonzero(np.isfinite(values))
    step = np.abs(np.diff(values[index]))
    if known.rate > 0.0:
        # A position step larger than its whole reach, and ten times faster than usual, is not a motion.
        is_leap = step > np.maximum(known.reach, 10.0 * known.rate * np.diff(time[index]))
        found, leaps = _behind_leaps(time[index], values[index], is_leap, known.reach, (centre, known.reach))
    else:
        near = 0.45 * 2**16 * abs(factor)  # a step of 16-bit integers twice as large is a wrap
        is_leap = (step >= 2.0 * near) & (near > _FAR_ENDS * known.reach)
        found, leaps = _behind_leaps(time[index], values[index], is_leap, near, None)
    wrong = np.zeros(len(values), dtype=bool)
    wrong[index[found]] = True
    return wrong, leaps


def _far_values(series: Series, j: int, wrong: BoolArray, known: ChannelRange, joint: str) -> dict[str, Any]:
    rows = np.flatnonzero(wrong)
    first, time = float(series.values[rows[0], j]), float(series.time[rows[0]])
    usual = {"centre": known.centre[j], "reach": known.reach, "unit": series.unit}
    return {"count": len(rows), "joint": joint, "first": first, "time": time, **usual}


def _behind_leaps(
    time: FloatArray, values: FloatArray, is_leap: BoolArray, near: float, usual: tuple[float, float] | None
) -> tuple[BoolArray, list[dict[str, Any]]]:
    """Return True (n,) for the values after a leap, and the leaps; `is_leap` (n - 1,): the steps that are leaps.

    A value is back if it is within `near` of the one before the leap. With `usual` (centre and reach) a position may
    also have been set to a new zero: a reset encoder stays among the usual positions and moves on, a failed one does
    not. Causal, except for a log that begins with wrong values.
    """
    wrong = np.zeros(len(values), dtype=bool)
    leaps = []
    end, places = 0, np.flatnonzero(is_leap).tolist()
    for number, at in enumerate(places):
        if at < end:
            continue
        leap = {"time": float(time[at + 1]), "before": float(values[at]), "after": float(values[at + 1])}
        if at < _EDGE and end == 0 and len(values) > 2 * _EDGE:
            wrong[: at + 1] = True
            leaps.append({**leap, "new_zero": math.nan})
            end = at + 2
            continue
        end, moves_on = _end(time, values, [*places[number:], len(values) - 1], near, usual)
        wrong[at + 1 : end] = True
        new_zero = float(time[end]) if moves_on else math.nan
        leaps.append({**leap, "new_zero": new_zero})
    return wrong, leaps


def _end(
    time: FloatArray, values: FloatArray, leaps: Sequence[int], near: float, usual: tuple[float, float] | None
) -> tuple[int, bool]:
    """Return the first valid value after `leaps[0]`, and whether from a new zero; the last row ends `leaps`."""
    before = values[leaps[0]]
    for first, last in pairwise(leaps):
        part = slice(first + 1, last + 1)
        back = np.abs(values[part] - before) <= near
        on = _moves_on(time[part], values[part], *usual) if usual else np.zeros_like(back)
        if (back | on).any():
            found = int(np.argmax(back | on))
            return first + 1 + found, not back[found]
    return len(values), False


def _moves_on(time: FloatArray, values: FloatArray, centre: float, reach: float) -> BoolArray:
    """Return True (n,) where the values after a leap have stayed among the usual ones so far, and have moved."""
    # It counts again once it has stayed within 1.5 times the usual reach for 0.1 s, and has moved by 2 % of it.
    among = np.logical_and.accumulate(np.abs(values - centre) <= 1.5 * reach)
    moved = np.abs(values - values[0]) >= 0.02 * reach
    on: BoolArray = among & moved & (time - time[0] >= 0.1)
    return on
