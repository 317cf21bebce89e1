"""A log's channels before conversion to the load side, from which plausible ranges are learned."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from cdtool.formats.source import Source
from cdtool.machines.dynamics import Machine
from cdtool.recordings.plausible import PlausibleRanges
from cdtool.recordings.recording import Recording


@dataclass(frozen=True)
class LoggedRecording:
    """A log's channels as logged, in SI, not yet on the load side; `factors` converted the logged numbers to SI.

    `headers` are its files without their rows: what they state.
    """

    recording: Recording
    factors: Mapping[str, tuple[float, ...]]
    speed_low_pass: float
    headers: tuple[Source, ...] = ()

    def on_load_side(
        self, machine: Machine, ranges: PlausibleRanges | None = None, *, to_learn: tuple[float, float] | None = None
    ) -> Recording:
        """Return the recording on the load side, without values outside the plausible ranges."""
        plausible = self.recording if ranges is None else ranges.masked(self.recording, self.factors, to_learn=to_learn)
        recording: Recording = machine.referred_to_load(plausible, self.speed_low_pass)
        return recording
