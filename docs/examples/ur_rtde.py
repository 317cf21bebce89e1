"""The recordings of a real UR10e as RTDE logs them: python docs/examples/ur_rtde.py FOLDER

`sample_logs/ur10e` has three recordings without names. This writes two of them as the program `record.py` of Universal
Robots' RTDE client does: separated by blanks, under the names of the RTDE outputs. The numbers are those of the
recordings. (The third one, `link4`, does not contain the target currents.)
"""

from __future__ import annotations

import gzip
import sys
from pathlib import Path

LOGS = Path("sample_logs/ur10e")
NAMES = ("actual_q", "actual_qd", "actual_current", "target_current", "target_moment")


def write_rtde(folder: Path) -> list[Path]:
    """Write the recordings; return the files."""
    folder.mkdir(parents=True, exist_ok=True)
    head = " ".join(["timestamp", *(f"{name}_{joint}" for name in NAMES for joint in range(6))])
    written = []
    for name in ("no_torque", "ur-static"):
        rows = gzip.decompress((LOGS / f"{name}.csv.gz").read_bytes()).decode("ascii").splitlines()
        path = folder / f"{name}.csv"
        path.write_text("\n".join([head, *(row.replace(",", " ") for row in rows)]) + "\n", encoding="ascii")
        written.append(path)
    return written


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit("usage: ur_rtde.py FOLDER")
    print(f"{len(write_rtde(Path(sys.argv[1])))} logs written to {sys.argv[1]}")
