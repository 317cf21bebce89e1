"""The texts and marks of a figure."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree

from tests.report.hostile import HOSTILE

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SVG = "{http://www.w3.org/2000/svg}"


def texts(path: Path) -> list[str]:
    """Return every text of an SVG, in order; raises an XML error for any other file."""
    return ["".join(item.itertext()) for item in ElementTree.parse(path).iter(f"{SVG}text")]


def joined(path: Path) -> str:
    """Return all texts, a line each."""
    found = texts(path)
    assert found
    return "\n".join(found)


def assert_harmless(path: Path, kind: str) -> None:
    """The hostile name of that kind is shown as plain text of bearable length and is no markup."""
    shown = joined(path)
    assert not set(shown) & set("\u202e\u2067\x00\x1b\ufffe")
    assert all(len(text) < 140 for text in texts(path))
    assert not list(ElementTree.parse(path).iter(f"{SVG}script"))
    if kind in ("math", "script"):
        assert HOSTILE[kind][:12] in shown


def assert_within(figure: Figure) -> None:
    """Nothing is drawn beyond the figure's edge."""
    figure.draw_without_rendering()
    drawn = figure.get_tightbbox()
    width, height = figure.get_size_inches()
    assert drawn.x0 >= -0.05
    assert drawn.y0 >= -0.05
    assert drawn.x1 <= width + 0.05
    assert drawn.y1 <= height + 0.05
