"""Make the figures of docs/impact.md: python docs/make_impact_figures.py (a few seconds)

They show simulated example impacts; nothing is taken from a file. An image above 200 kB is an error.
"""

from __future__ import annotations

import sys
from pathlib import Path

from cdtool.report.plots.impact_plots import write_impact_plots

IMAGES = Path(__file__).resolve().parent / "images"
LARGEST = 200_000


def main() -> None:
    """Write the images; ends with an error where one is too large."""
    for path in write_impact_plots(IMAGES):
        size = path.stat().st_size
        print(f"{path.name}: {size / 1000:.0f} kB")
        if size > LARGEST:
            sys.exit(f"{path.name} is larger than {LARGEST / 1000:.0f} kB")


if __name__ == "__main__":
    main()
