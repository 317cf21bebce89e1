"""The clock of columns that a file stores together: found by its name, in a unit that its name or its stamps state."""

from __future__ import annotations

import re
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from cdtool.base.findings import Finding
from cdtool.formats.columns import as_float64
from cdtool.formats.epoch_clock import EpochClock
from cdtool.recordings.clock.plausible_unit import SECONDS, unit_since_1970

_NAME = re.compile(r"^(t|ts|time|tout|timestamp|zeit|clock|tempo|temps)([^a-z]|$)", re.IGNORECASE)
# A clock's unit at the end of its name: `t_ms`.
_UNIT_IN_NAME = re.compile(r"_(s|ms|us|ns)$")
# Upper limit of the median step -> unit, as for the clock of a table.
_UNITS = ((0.5, "s"), (500.0, "ms"), (5e5, "us"), (np.inf, "ns"))


def is_clock_name(name: str) -> bool:
    """Return whether a column has the name of a clock."""
    return _NAME.match(name) is not None


def assumed_clock(name: str, stamps: npt.NDArray[Any], findings: list[Finding]) -> EpochClock:
    """Return a column of stamps (n,), n > 0, as a clock; the finding on its unit is added to `findings`.

    The unit is at the end of the name, or that of a start after 1970, or that of the steps. A unit other than s that
    only the steps state is a warning.
    """
    known = stamps[np.isfinite(stamps)] if stamps.dtype.kind == "f" else stamps
    start, step = (float(known[0]) if len(known) else 0.0), _usual_step(known)
    in_name, epoch = _UNIT_IN_NAME.search(name), unit_since_1970(start)
    if in_name or epoch:
        label, evidence = (in_name[1], "name") if in_name else (epoch, "epoch")
    else:
        label, evidence = next(unit for most, unit in _UNITS if step < most), "steps"
    severity: Literal["note", "warning"] = "warning" if evidence == "steps" and label != "s" else "note"
    findings.append(
        Finding("assumed_clock", name, {"unit": label, "evidence": evidence, "start": start, "step": step}, severity)
    )
    return EpochClock(lambda first, end: stamps[first:end], SECONDS[label])


def _usual_step(stamps: npt.NDArray[Any]) -> float:
    """Return the median step forward between time stamps; 0 without one."""
    steps = np.diff(as_float64(stamps))
    steps = steps[steps > 0.0]
    return float(np.median(steps)) if len(steps) else 0.0
