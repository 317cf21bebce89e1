"""Write the table of results in README.md as the benchmark of the sample logs prints it: python docs/make_results.py"""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
README = ROOT / "README.md"
_ROW = re.compile(r"^(?:stiff|soft) +\w+ +[\d-].*$", re.MULTILINE)


def with_rows(page: str, printed: str) -> str:
    """Return a page with the rows of impacts as they are printed; raises KeyError for a row that is not printed."""
    rows = {tuple(row.split()[:2]): row.rstrip() for row in _ROW.findall(printed)}

    def newest(shown: re.Match[str]) -> str:
        row = rows[tuple(shown[0].split()[:2])]
        # How wide the columns are is the terminal's business.
        return shown[0] if row.split() == shown[0].split() else row

    return _ROW.sub(newest, page)


if __name__ == "__main__":
    command = (sys.executable, "-c", "from cdtool.commands.app import main; main()")
    arguments = ("benchmark", "sample_logs/gate/benchmark.toml")
    done = subprocess.run([*command, *arguments], capture_output=True, text=True, check=True, cwd=ROOT)
    README.write_text(with_rows(README.read_text(encoding="utf-8"), done.stdout), encoding="utf-8")
