"""A benchmark of all ten detectors on a simulated folder: writes all_detectors.toml and all_machine.toml into it.

Usage: python docs/examples/all_detectors.py FOLDER, then cdtool benchmark FOLDER/all_detectors.toml
"""

from __future__ import annotations

import re
import sys
from pathlib import Path

from cdtool.detectors import DETECTORS

# The arm's machine file has gains for GM, IGM and FEEKF. These give the others the same bandwidth, 86 rad/s.
ARM_GAINS = """
[detectors.direct]
cutoff = 13.7            # Hz: 86 rad/s

[detectors.desired_dynamics]
cutoff = 13.7
tracking_limit = 0.1     # rad

[detectors.energy]
bandwidth = 86.0         # rad/s

[detectors.velocity]
bandwidth = 86.0

[detectors.kalman_momentum]
sigma_speed = 0.01       # rad/s, as for the friction EKF
sigma_torque = 0.1       # N m
contact_drift = 0.35     # N m per sqrt(s): 0.35 / (0.14 kg m2 * 0.01 rad/s * sqrt(1 ms)) = 89^2 (rad/s)^2
"""


def main(folder: Path) -> int:
    """Write the two files beside those that cdtool simulate wrote."""
    machine = (folder / "machine.toml").read_text(encoding="utf-8")
    gains = ARM_GAINS if 'type = "planar_arm"' in machine else ""
    (folder / "all_machine.toml").write_text(machine + gains, encoding="utf-8")
    benchmark = (folder / "benchmark.toml").read_text(encoding="utf-8")
    names = ", ".join(f'"{name}"' for name in DETECTORS.names())
    benchmark = re.sub(r"(?m)^machine = .*$", 'machine = "all_machine.toml"', benchmark)
    benchmark = re.sub(r"(?m)^detectors = .*$", f"detectors = [{names}]", benchmark)
    (folder / "all_detectors.toml").write_text(benchmark, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
