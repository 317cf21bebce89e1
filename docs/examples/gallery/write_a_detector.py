"""Write a detector.

A detector is a frozen dataclass that turns a recording into a signal. In a notebook it is used as it is; as a
[plug-in](../own-detector.md) it also has a name on the command line.
"""

# %%
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import cdtool
from cdtool.detectors.base import gain, require_channels
from cdtool.detectors.filters import low_pass, settling_time, started_at


@dataclass(frozen=True)
class TorqueRate:
    """The rate of change of the low-passed drive force: an impact makes the controller push."""

    cutoff: float = gain(2.0, "Hz", "cut-off frequency of the low-pass")

    name = "torque_rate"
    short_name = "tr"
    title = "Torque rate"
    needs = ("torque",)
    signed = True

    def unit(self, machine):
        """Return the unit of the signal."""
        return f"{machine.force_unit}/s"

    def signal(self, recording, machine):
        """Return the rate on the torque's own clock."""
        require_channels(self, recording)
        torque = recording["torque"]
        missing = ~np.isfinite(torque.values)
        cutoff = np.full(torque.joint_count, self.cutoff)
        _, rate = low_pass(torque.time, torque.values, missing, cutoff)
        settle = settling_time(cutoff)
        starting = torque.time[:, np.newaxis] < started_at(torque.time, missing, settle) + settle
        status = np.where(starting, cdtool.Status.START_UP, cdtool.Status.VALID).astype(np.uint8)
        status[missing] = cdtool.Status.GAP
        return cdtool.Signal(torque.time, rate, status, self.unit(machine), self.signed)


# %% [markdown]
# Every sample has a status: a detector says where it cannot know, and such samples raise no alarm and count as not
# assessable. The filters work sample by sample: a detector never uses a later sample.

# %%
gate = Path("sample_logs/gate")
machine = gate / "machine.toml"
learned = cdtool.learn_signature(sorted(gate.glob("free/*")), machine, TorqueRate())
logs = sorted(gate.glob("stiff/*")) + sorted(gate.glob("soft/*")) + sorted(gate.glob("holdout/*"))
found = cdtool.detect(logs, machine, signature=learned, detector=TorqueRate())
found

# %%
found.contacts[["recording", "outcome", "latency_ms"]]

# %%
found[2].plot()

# %% [markdown]
# It is beaten by most others: compare it with those of [the notebook](../examples/gate.ipynb). The
# [recipe](../recipes.md#add-a-detector) describes the contract, and the tests that show whether a detector keeps it.
