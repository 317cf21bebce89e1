"""Tune a detector at a false-alarm budget.

Which threshold is the fastest, if one operation in ten may raise a false alarm? The search is repeated without each
fifth of the recordings, so that the results are from recordings not used for the choice.
"""

# %%
from pathlib import Path

import cdtool

cdtool.simulate_gate(Path("gate"), {"free": 25, "holdout": 2, "stiff": 10, "soft": 10}, seed=5)
tried = {"tune.thresholds": ["limit", "signature"]}
tuned = cdtool.tune("gate/benchmark.toml", "1/10op", detectors=["gm"], settings=tried)
tuned.summary()

# %% [markdown]
# `default_mean_ms` is what the benchmark file has, at the same budget.

# %%
means = (
    tuned.summary().set_index("group")[["default_mean_ms", "mean_ms"]].set_axis(["default", "tuned"], axis="columns")
)
axes = means.plot.barh(xlabel="mean latency [ms]", ylabel="", xticks=range(0, 121, 20), figsize=(7, 2.2))

# %% [markdown]
# The gains that were chosen, and over which range of each the latency stays within 5 % of the best:

# %%
best = tuned.detectors[0]
print(best.detector, dict(best.choice.gains), "debounce", best.debounce)
for item in best.sensitivities:
    print(f"{item.name}: {item.chosen:.3g}, flat from {item.flat_from:.3g} to {item.flat_to:.3g}")

# %% [markdown]
# A chosen value at the edge of its range may not be the best one. [Tuning](../tuning.md) says how many runs a budget
# needs. The command `cdtool tune` also writes the machine file and the benchmark file with the choice.
