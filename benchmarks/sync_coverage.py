"""Do the intervals of the sync audit contain the true offset and drift of a load cell's clock?

python benchmarks/sync_coverage.py [sets] [--seed SEED]

Each set is a log of ten minutes with twelve contacts of a rigid axis, from stiff to soft. Offset (0 to 20 ms), drift (0
to 100 ppm), sample rates, jitter, noise and steps of the sensors are drawn for each set. Further rows: few contacts in
a short log, where a drift is not assessable. Exits with 1 if intervals contain the truth in less than 92 % of the sets,
or a drift is wrong by more than 5 ppm. A set takes about half a second.
"""

from __future__ import annotations

import argparse
import math
import sys
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from timing import environment, table

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

from cdtool.truth.synchronisation.audit import audit
from cdtool.truth.synchronisation.latency import ChannelLatency, preferred
from tests.synthetic.shifted_clocks import Clocks, Sensors, axis, collisions

SETS = 300
LEAST_COVERAGE = 0.92
LARGEST_DRIFT_ERROR = 5e-6
# Contacts, length of the log [s], share of the sets; the requirements hold for the first row.
ROWS = ((12, 600.0, 1.0), (8, 600.0, 0.5), (5, 120.0, 0.25))


@dataclass(frozen=True)
class Outcome:
    """What the audit found in a set, and the truth."""

    found: ChannelLatency
    clocks: Clocks

    @property
    def error(self) -> float:
        return self.found.offset.value - self.clocks.at(self.found.at)

    @property
    def half(self) -> float:
        return 0.5 * (self.found.offset.high - self.found.offset.low)

    @property
    def drift_error(self) -> float:
        return self.found.drift.value - self.clocks.drift


def main(sets: int, seed: int) -> int:
    """Print the table; return 0 if the requirements are met."""
    print(f"== sync audit: 95 % intervals of a load cell's offset and drift\n{environment()}", flush=True)
    lines, sound = [], True
    for contacts, length, share in ROWS:
        outcomes = [outcome(seed, number, contacts, length) for number in range(max(round(share * sets), 1))]
        known = [item for item in outcomes if item.found.assessable]
        hits = np.mean([abs(item.error) <= item.half for item in known]) if known else 0.0
        drifts = [item for item in known if item.found.drift.known]
        largest = max((abs(item.drift_error) for item in drifts), default=math.nan)
        within = np.mean([_holds_drift(item) for item in drifts]) if drifts else math.nan
        lines.append(
            (
                f"{contacts} in {length:g} s",
                len(outcomes),
                len(outcomes) - len(known),
                f"{100 * hits:.1f}",
                f"{1e3 * np.sqrt(np.mean([item.error**2 for item in known])):.2f}",
                f"{1e3 * np.median([item.half for item in known]):.2f}",
                f"{100 * within:.1f}" if drifts else "-",
                f"{1e6 * largest:.1f}" if drifts else "-",
            )
        )
        if (contacts, length) == ROWS[0][:2]:
            sound &= hits >= LEAST_COVERAGE and len(drifts) == len(outcomes) and largest <= LARGEST_DRIFT_ERROR
    head = (
        "contacts",
        "sets",
        "not assessable",
        "offset covered %",
        "rms error ms",
        "half width ms",
        "drift covered %",
        "largest drift error ppm",
    )
    table(head, lines)
    print(f"{'ok  ' if sound else 'FAIL'}  first row: at least 92 % covered, drift within 5 ppm", flush=True)
    return 0 if sound else 1


def _holds_drift(item: Outcome) -> bool:
    return item.found.drift.low <= item.clocks.drift <= item.found.drift.high


def outcome(seed: int, number: int, contacts: int, length: float) -> Outcome:
    """Return the audit of one set."""
    rng = np.random.default_rng([seed, contacts, number])
    clocks = Clocks(
        offset=rng.uniform(0.0, 0.02),
        drift=rng.uniform(0.0, 1e-4),
        machine_rate=float(rng.choice([250.0, 500.0, 1000.0])),
        cell_rate=float(rng.choice([500.0, 1000.0, 2000.0])),
        jitter=float(rng.choice([0.0, 1e-4, 3e-4])),
    )
    sensors = Sensors(
        force_noise=float(rng.choice([0.5, 2.0, 5.0])),
        force_step=float(rng.choice([0.0, 0.5, 5.0])),
        torque_noise=float(rng.choice([0.0, 5.0, 20.0])),
        speed_noise=float(rng.choice([5e-4, 2e-3, 5e-3])),
        position_step=float(rng.choice([1e-6, 1e-5, 5e-5])),
    )
    starts = np.sort(rng.uniform(0.0, max(length - 5.0 * contacts, 0.0), contacts)) + 5.0 * np.arange(contacts)
    recording, true = collisions(rng, starts, clocks, sensors)
    (found,) = [item for item in preferred(audit(recording, axis(), true)) if item.channel == "force"]
    return Outcome(found, clocks)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sets", type=int, nargs="?", default=SETS)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    sys.exit(main(asked.sets, asked.seed))
