"""Compare detectors.

A benchmark file names the logs, the detectors and the limits. The result has every contact as a row of a DataFrame, the
statistics of the reports, and their figures.
"""

# %%
import cdtool

result = cdtool.benchmark("sample_logs/gate/benchmark.toml", jobs=2)
result

# %% [markdown]
# The counts are first: a detector that misses its slow contacts looks fast. NaN: not known, for example the latency
# of a group without contacts.

# %%
result.summary()[["detected", "missed", "not_assessable", "false_alarms", "median_ms", "max_ms", "force_at_alarm_n"]]

# %%
result.contacts.pivot(index=["group", "recording"], columns="detector", values="latency_ms")

# %%
result.plot.latency()

# %% [markdown]
# The share of the contacts that are still undetected over the time since their onset:

# %%
result.plot.survival()

# %% [markdown]
# All detectors on one recording, below the load cell. The curves of a few recordings are kept, those that show most.

# %%
result.plot.triggers(group="soft")

# %% [markdown]
# `result.save("report/")` writes the reports, as `cdtool benchmark -o report/` does; `cdtool.read_results` reads them
# back. Which detectors really differ, and how many recordings it takes to show it: [Statistics](../statistics.md).
