"""Sweep a parameter.

How fast should the momentum observer be? A wide bandwidth follows a contact sooner, and the noise too, which widens the
band that is learned from the impact-free runs.
"""

# %%
from pathlib import Path

import pandas as pd

import cdtool
from cdtool.detectors.momentum import Momentum

gate = Path("sample_logs/gate")
machine = cdtool.read_machine_file(gate / "machine.toml")
free = sorted(gate.glob("free/*"))
logs = sorted(gate.glob("stiff/*")) + sorted(gate.glob("soft/*"))

# %% [markdown]
# A detector with other gains is an instance of its class. The signature is learned again for each: it belongs to the
# gains.

# %%
swept = {}
for bandwidth in (10.0, 20.0, 40.0, 80.0, 160.0):
    observer = Momentum(bandwidth=bandwidth)
    learned = cdtool.learn_signature(free, machine, observer)
    found = cdtool.detect(logs, machine, signature=learned, detector=observer)
    kind = found.contacts.recording.str.split("/").str[-2].rename("kind")
    swept[bandwidth] = found.contacts.latency_ms.groupby(kind).median()
sweep = pd.DataFrame(swept).T.rename_axis("bandwidth [rad/s]")
sweep

# %%
axes = sweep.plot(style=["o-", "s--"], ylabel="median latency [ms]", ylim=(0, 120), logx=True, figsize=(7, 3))
axes.set_xticks(sweep.index, [f"{bandwidth:.0f}" for bandwidth in sweep.index])
axes.minorticks_off()

# %% [markdown]
# Above 40 rad/s the soft contacts are detected hardly any sooner: the learned band widens with the noise. Eight
# contacts show no more than a tendency. [Tune](tune.md) searches all settings at once, at a false-alarm budget.
