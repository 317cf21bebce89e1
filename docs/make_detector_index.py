"""Make docs/detectors/index.md from the registered detectors and their pages: python docs/make_detector_index.py"""

from __future__ import annotations

from pathlib import Path

from cdtool.detectors import DETECTORS

FOLDER = Path(__file__).with_name("detectors")
FILE = FOLDER / "index.md"

_HEAD = """# The detectors

Each page gives the equation, the signal and its unit, the gains with their defaults, and when the detector fails.
[How to choose](../choosing.md) compares them. `cdtool list detectors` also lists those of installed plug-ins.

| detector | short name | channels | what it looks at |
|---|---|---|---|
"""


def index_text() -> str:
    """Return the file's content: a row per detector with its page's title and first paragraph."""
    return _HEAD + "".join(map(_row, DETECTORS.names()))


def _row(name: str) -> str:
    detector = DETECTORS.load(name)
    page = f"{name.replace('_', '-')}.md"
    heading, paragraph = (FOLDER / page).read_text(encoding="utf-8").split("\n\n")[:2]
    title = heading.removeprefix("# ").partition(" (")[0]
    cells = (f"[{title}]({page})", f"`{detector.short_name}`", ", ".join(detector.needs), " ".join(paragraph.split()))
    return f"| {' | '.join(cells)} |\n"


if __name__ == "__main__":
    FILE.write_text(index_text(), encoding="utf-8")
