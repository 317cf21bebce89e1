"""Ground truth: when did the contact begin? The load cell's onset, with its uncertainty.

Conventions: the baseline and the noise come from the samples before the contact; a contact begins where the force,
followed back from the first of `samples` samples above the upper level, left the lower level. State the rule in every
report: in soft impacts the cell feels the contact tens of milliseconds after touch. The steps in which the cell reads
come from the whole log: the truth is found afterwards, and nothing live rests on it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdtool.errors import RecordingError, UsageError
from cdtool.recording import Contact, FloatArray, Recording

# Baseline and noise: this share of the recording from its start, and at least this many samples.
_BASELINE_SHARE = 0.1
_BASELINE_SAMPLES = 20
# A standard deviation from the median absolute deviation of Gaussian noise.
_MAD = 1.4826
# Standard deviation of the error of rounding to steps of 1: uniform between -1/2 and 1/2.
_ROUNDING = 12.0**-0.5
# Readings closer than this share of the largest one differ by what arithmetic rounds, not by a step of the cell.
_SAME = 1e-6


@dataclass(frozen=True)
class OnsetRule:
    """Upper level `above` and lower level `back_to` [N over the baseline]; None: from the noise (`sigmas`, half of it).

    `samples` in succession above the upper level; contacts closer than `separation` [s] are one (a rebound).
    """

    above: float | None = None
    back_to: float | None = None
    samples: int = 3
    sigmas: float = 8.0
    separation: float = 1.0

    def __post_init__(self) -> None:
        for name in ("above", "back_to"):
            value = getattr(self, name)
            if value is not None and not value > 0.0:
                raise UsageError(f"onset: {name} is {value}", "a force above 0 N")
        if self.above is not None and self.back_to is not None and self.back_to > self.above:
            raise UsageError(f"onset: back_to is {self.back_to:g}, more than above", "at most above")

    @property
    def described(self) -> str:
        """The rule in words, for reports."""
        above = f"{self.above:g} N" if self.above is not None else f"{self.sigmas:g} standard deviations of the noise"
        back = f"{self.back_to:g} N" if self.back_to is not None else "half of it"
        return f"load cell above {above} for {self.samples} samples, followed back to {back}"


def find_contacts(recording: Recording, rule: OnsetRule) -> list[Contact]:
    """Contacts by the load cell, else by the label channel, else by events; raises RecordingError without any."""
    for channel, found in (("force", _from_force), ("label", _from_label), ("event", _from_events)):
        if channel in recording:
            return found(recording, rule)
    raise RecordingError(
        f"{recording.name}: no ground truth: none of 'force', 'label', 'event' is mapped",
        "map the load cell in [channels], name a label file, or use cdtool detect",
    )


def baseline(force: FloatArray) -> tuple[float, float]:
    """Reading at rest and its noise, a standard deviation [N]: of the first tenth of a recording's load cell (n,).

    `force` holds no missing samples. Both are wrong where the recording begins in a contact.
    """
    first = force[: max(_BASELINE_SAMPLES, int(_BASELINE_SHARE * len(force)))]
    rest = float(np.median(first))
    return rest, _MAD * float(np.median(np.abs(first - rest)))


def reading_step(force: FloatArray) -> float:
    """The step in which a load cell (n,) reads [N]: the smallest distance between two of its readings; 0 of one alone.

    Where it is coarser than the cell's noise, the median absolute deviation is 0 although the reading flickers by a
    step: the noise is then no less than the rounding's own, step / sqrt(12) (Widrow and Kollar, Quantization Noise,
    2008), so that 8 standard deviations are 2.3 steps. A cell that gives two readings only, such as a switch, has no
    step beside its contacts, which stay below that: it is a `label`, or needs a level by hand. `force` holds no missing
    samples.
    """
    distances = np.diff(np.unique(force))
    distances = distances[distances > _SAME * float(np.max(np.abs(force)))]
    return float(distances.min()) if len(distances) else 0.0


def _from_force(recording: Recording, rule: OnsetRule) -> list[Contact]:
    series = recording["force"]
    present = np.isfinite(series.values[:, 0])
    time, force = series.time[present], series.values[present, 0]
    if len(force) < rule.samples + 2:
        return []
    rest, noise = baseline(force)
    noise = max(noise, _ROUNDING * reading_step(force))
    above = rule.above if rule.above is not None else max(rule.sigmas * noise, 1e-9)
    back_to = min(rule.back_to if rule.back_to is not None else 0.5 * above, above)
    over = np.abs(force - rest)
    high = over > above
    run = high.copy()
    for lag in range(1, rule.samples):
        run[:-lag] &= high[lag:]
        run[-lag:] = False
    contacts: list[Contact] = []
    half_sample = 0.5 * float(np.median(np.diff(time)))
    starts = np.flatnonzero(run)
    low = np.flatnonzero(over <= back_to)
    searched = -np.inf
    for k in starts:
        if time[k] <= searched:
            continue
        before = low[np.searchsorted(low, k) - 1] if len(low) and low[0] < k else -1
        onset = before + 1
        end = _end_of_contact(time, over, int(k), back_to, rule.separation)
        # Where samples are missing before the onset, it may have come at any time in the hole.
        earlier = max(half_sample, float(time[onset] - time[before]) - half_sample) if before >= 0 else half_sample
        contacts.append(
            Contact(
                start=float(time[onset]),
                end=float(time[end]),
                uncertainty=earlier + float(time[k] - time[onset]),
                peak_force=float(np.max(over[onset : end + 1])),
                found_by="load cell",
            )
        )
        searched = float(time[end]) + rule.separation
    return contacts


def _end_of_contact(time: FloatArray, over: FloatArray, start: int, back_to: float, separation: float) -> int:
    """The last sample above the lower level before the force stays below it for `separation` seconds."""
    pressed = np.flatnonzero(over[start:] > back_to) + start
    pauses = np.flatnonzero(np.diff(time[pressed]) > separation)
    return int(pressed[pauses[0]] if len(pauses) else pressed[-1])


def _from_label(recording: Recording, _: OnsetRule) -> list[Contact]:
    series = recording["label"]
    present = np.isfinite(series.values[:, 0])  # a missing sample does not end a contact
    time, touched = series.time[present], (series.values[present, 0] > 0.5).astype(int)
    edges = np.diff(np.concatenate(([0], touched, [0])))
    half_sample = 0.5 * series.period if len(series) > 1 else 0.0
    return [
        Contact(float(time[a]), float(time[b - 1]), half_sample, found_by="label")
        for a, b in zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1), strict=True)
    ]


def _from_events(recording: Recording, rule: OnsetRule) -> list[Contact]:
    series = recording["event"]
    times = series.time[np.nan_to_num(series.values[:, 0]) != 0.0]
    apart = np.concatenate(([True], np.diff(times) > rule.separation)) if len(times) else np.empty(0, dtype=bool)
    return [Contact(float(time), float(time), 0.0, found_by="event") for time in times[apart]]
