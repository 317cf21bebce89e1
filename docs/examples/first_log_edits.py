"""The edits of docs/init.md: python docs/examples/first_log_edits.py MACHINE_FILE

A person reads the list of columns beside the log and corrects three lines of the drafted machine file.
"""

from __future__ import annotations

import sys
from pathlib import Path

EDITS = """torque = { columns = [13, 14, 15, 16, 17, 18], unit = "A", scale = 9.0 }
reference_torque = { columns = [31, 32, 33, 34, 35, 36], unit = "A", scale = 9.0 }
force = { columns = [37, 38, 39], unit = "N" }
"""


def edited(draft: str) -> str:
    """Return a drafted machine file with the three lines in place of its own."""
    channels, unmapped, rest = draft.partition("\n# Not mapped")
    names = ("torque =", "reference_torque =", "force =")
    kept = [line for line in channels.splitlines() if not line.startswith(names)]
    return "\n".join([*kept, EDITS]) + unmapped + rest


if __name__ == "__main__":
    file = Path(sys.argv[1])
    file.write_text(edited(file.read_text(encoding="utf-8")), encoding="utf-8")
