"""Query a fleet.

The contacts of several machines in one DataFrame: which door is slow, and for which detector? Here three doors are
simulated; the columns are the same for recordings.
"""

# %%
from pathlib import Path

import pandas as pd

import cdtool
from cdtool.report.plots.style import look_of

results = {}
for number, door in enumerate(("door-1", "door-2", "door-3"), 1):
    cdtool.simulate_gate(Path(door), {"free": 10, "holdout": 1, "stiff": 3, "soft": 3}, seed=number)
    results[door] = cdtool.benchmark(f"{door}/benchmark.toml", detectors=["gm", "feekf", "pt"])
contacts = pd.concat({door: result.contacts for door, result in results.items()}, names=["door", None])
contacts = contacts.reset_index("door")
contacts.groupby(["door", "outcome"], observed=True).size().unstack(fill_value=0)

# %% [markdown]
# A missed contact has no latency. To rank doors, it counts as later than all others: a median that ignores it looks
# too good.

# %%
contacts["at_worst_ms"] = contacts.latency_ms.where(contacts.outcome != "missed", float("inf"))
medians = contacts.pivot_table("at_worst_ms", ["group", "door"], "detector", aggfunc="median", observed=True)
medians

# %%
colours = {name: look_of(name).colour for name in medians}
axes = medians.loc["stiff"].plot.bar(rot=0, ylabel="median latency [ms]", ylim=(0, 200), color=colours, figsize=(6, 3))
axes.legend(loc="upper left", bbox_to_anchor=(1.0, 1.0))

# %% [markdown]
# The slowest contacts of all doors, to be looked at first:

# %%
worst = contacts.nlargest(3, "at_worst_ms")
worst[["door", "recording", "detector", "latency_ms", "peak_force_n"]]

# %% [markdown]
# Of very many recordings, write `results.parquet`, and query the files without loading them: [Queries over
# results](../many-recordings.md).
