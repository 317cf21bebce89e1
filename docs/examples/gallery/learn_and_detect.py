"""Learn and detect.

A signature is the normal band of a detector's signal, learned from impact-free runs. It is then compared with logs in
which something was hit, and with one in which nothing was.
"""

# %%
from pathlib import Path

import cdtool

gate = Path("sample_logs/gate")
machine = gate / "machine.toml"
learned = cdtool.learn_signature(sorted(gate.glob("free/*")), machine, "friction_ekf")
learned.save("gate.json")  # for `cdtool detect --signature gate.json`
learned

# %% [markdown]
# `detect` takes one log or many. Of many, a log that cannot be read is left out and listed in `skipped`.

# %%
logs = sorted(gate.glob("stiff/*")) + sorted(gate.glob("soft/*")) + [gate / "holdout/03.csv"]
found = cdtool.detect(logs, machine, signature=learned)
found

# %%
found.summary()[["recording", "verdict", "alarms", "contacts", "assessed_s"]]

# %% [markdown]
# Each alarm names its joint and the contact that it belongs to; each contact says how late it was detected, and at
# which force.

# %%
found.contacts[["recording", "latency_ms", "force_at_alarm_n", "peak_force_n"]]

# %% [markdown]
# A single result is drawn as by `cdtool detect --plot`: here the slowest one.

# %%
slowest = found.contacts.latency_ms.idxmax()
found[int(slowest)].plot()
