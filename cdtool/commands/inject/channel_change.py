"""What a contact adds to a channel of a recording, over time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cdtool.base.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class ChannelChange:
    """What is added to a channel: `values` (n, J) at `time` (n,) [s], on the load side; nothing before `start` [s].

    A `held` channel keeps a value until the next one, such as the command of a sampled controller; the others are
    linear between the simulated samples. After the last time nothing is known.
    """

    time: FloatArray
    values: FloatArray
    start: float
    held: bool = False

    def at(self, time: FloatArray) -> FloatArray:
        """Return the change (m, J) at the times of a channel's own clock: 0 before the contact, NaN after the end."""
        found = np.zeros((len(time), self.values.shape[1]))
        period = float(self.time[1] - self.time[0])
        if self.held:
            # A clock that is off by rounding only must not lose a sample.
            index = np.searchsorted(self.time, time + 1e-6 * period, side="right") - 1
            found[index >= 0] = self.values[index[index >= 0]]
        else:
            for joint in range(self.values.shape[1]):
                found[:, joint] = np.interp(time, self.time, self.values[:, joint])
        found[time <= self.start] = 0.0
        found[time > self.time[-1] + 1e-6 * period] = np.nan
        return found

    @property
    def is_nothing(self) -> bool:
        """Whether the contact does not change this channel."""
        return not np.any(self.values)
