"""A first look at a log.

What is in the log, whether it can be trusted, and whether anything in it looks like a contact, before any signature
is learned.
"""

# %%
import cdtool

log, machine = "sample_logs/gate/stiff/03.csv", "sample_logs/gate/machine.toml"
recording = cdtool.read(log, machine)
recording

# %% [markdown]
# A `Recording` has every channel on the load side in SI units. In Jupyter it is shown as a table of its channels; as
# text it is one line. `to_frame` returns a DataFrame. Channels with other clocks have rows of their own: nothing is
# interpolated.

# %%
frame = recording.to_frame(["speed", "torque", "force"])
frame.describe().loc[["min", "50%", "max"]].round(2)

# %% [markdown]
# What `cdtool info` would say about the log: clocks, gaps, saturation, units that cannot be right.

# %%
for finding in cdtool.info(log, machine=machine).findings:
    print(f"{finding.severity}: {finding}")

# %% [markdown]
# Without impact-free runs, the first seconds in motion can serve as the normal state (`warm_up`). Such limits are
# coarse; they show where to look. The load cell is below: it is never an input of a detector.

# %%
found = cdtool.detect(
    log, machine, detector="momentum", settings={"threshold.name": "baseline", "threshold.warm_up": 2.0}
)
found.plot()

# %%
found.contacts[["onset_s", "alarm_s", "latency_ms", "outcome", "peak_force_n"]]

# %% [markdown]
# The load cell shows one contact, and the momentum observer notices it. Limits that were learned from impact-free
# runs are closer to the signal: [the notebook](../examples/gate.ipynb).
