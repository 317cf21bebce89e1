"""Figures without global state: object API, backend by suffix, plain text, the same bytes for the same input."""

from __future__ import annotations

import re
import unicodedata
import warnings
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any, NamedTuple

from cdtool.base.errors import OutputError, UsageError
from cdtool.base.files.writing import write_bytes
from cdtool.base.plain_text import plain, shorten
from cdtool.report.number_text import number

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SUFFIXES = (".png", ".svg", ".pdf")

#: Letters of 7 points are sharp, and a figure of 9 in is 1080 pixels wide.
_DPI = 120
_BACKENDS = {
    ".png": "matplotlib.backends.backend_agg",
    ".svg": "matplotlib.backends.backend_svg",
    ".pdf": "matplotlib.backends.backend_pdf",
}
# A date or the version of a library would change the bytes of a figure with the same content.
_METADATA: dict[str, dict[str, Any]] = {
    ".png": {"Software": "cdtool"},
    ".svg": {"Date": None, "Creator": "cdtool"},
    ".pdf": {"CreationDate": None, "ModDate": None, "Creator": "cdtool", "Producer": None},
}
_STYLE: dict[str, object] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "cdtool",
    "pdf.fonttype": 42,
    "text.parse_math": False,
    "text.usetex": False,
    "axes.unicode_minus": True,
    "axes.formatter.useoffset": False,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.labelsize": 9,
    "axes.titlesize": 9,
    "axes.linewidth": 0.7,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "xtick.major.width": 0.7,
    "ytick.major.width": 0.7,
    "legend.fontsize": 8,
    "legend.frameon": False,
    "lines.linewidth": 1.2,
    "hatch.linewidth": 0.8,
    "figure.constrained_layout.h_pad": 0.03,
    "figure.constrained_layout.w_pad": 0.05,
}
# Settings other than appearance: a backend is never chosen here, and reading some of them warns.
_NOT_STYLE = ("backend", "interactive", "toolbar", "timezone", "tk.", "webagg.", "keymap.", "docstring.", "savefig.dir")


@contextmanager
def drawing() -> Iterator[None]:
    """Apply matplotlib's defaults and this project's style within a `with`, whatever the user's matplotlibrc.

    Raises OutputError if matplotlib finds no writable folder.
    """
    try:
        import matplotlib
    except OSError as fault:
        raise OutputError(
            "matplotlib finds no writable folder, neither for its settings nor for temporary files",
            "set MPLCONFIGDIR to a writable folder",
        ) from fault

    defaults: Any = matplotlib.rcParamsDefault
    settings: Any = {key: defaults[key] for key in defaults if not key.startswith(_NOT_STYLE)} | _STYLE
    with matplotlib.rc_context(settings), warnings.catch_warnings():
        # A glyph that is missing from the font is drawn as a box: there is nothing that a user could do about it.
        warnings.filterwarnings("ignore", message="Glyph .* missing from", category=UserWarning)
        warnings.filterwarnings("ignore", message="Matplotlib currently does not support", category=UserWarning)
        yield


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure of a size [inch] that arranges itself; for use within `drawing()`."""
    from cdtool.report.plots.shown_figure import ShownFigure

    return ShownFigure(encoded, figsize=(width, height), dpi=_DPI, layout="constrained")


def message_figure(text: str) -> Figure:
    """Return a figure that says why there is nothing to show; for use within `drawing()`."""
    figure = new_figure(9.0, 1.2)
    figure.text(0.5, 0.5, text, ha="center", va="center")
    return figure


class Margins(NamedTuple):
    """Margins around the panels of a figure [inch]."""

    left: float
    right: float
    top: float
    bottom: float


def stacked_panels(
    width: float, heights: Sequence[float], margins: Margins, gap: float = 0.16
) -> tuple[Figure, list[Axes]]:
    """Return a column of panels of given heights [inch], `gap` apart, on one time axis that is labelled at the bottom.

    Positions are given, not found by trial: it draws in half the time of a figure that arranges itself. For use
    within `drawing()`.
    """
    from cdtool.report.plots.shown_figure import ShownFigure

    height = margins.top + sum(heights) + gap * (len(heights) - 1) + margins.bottom
    figure = ShownFigure(encoded, figsize=(width, height), dpi=_DPI)
    panels: list[Axes] = []
    top = height - margins.top
    for panel in heights:
        place = (margins.left, top - panel, width - margins.left - margins.right, panel)
        sizes = (width, height, width, height)
        left, bottom, wide, high = (round(at / size, 6) for at, size in zip(place, sizes, strict=True))
        axes = figure.add_axes((left, bottom, wide, high), sharex=panels[0] if panels else None)
        panels.append(axes)
        top -= panel + gap
    for axes in panels[:-1]:
        axes.tick_params(axis="x", which="both", labelbottom=False)
    return figure, panels


def text_width(texts: Iterable[str], size: float) -> float:
    """Return the width [inch] of the widest line of texts at a font size [points]; for use within `drawing()`."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    font = FontProperties(size=size)
    lines = {line for text in texts for line in text.splitlines() if line}
    widths = [text_to_path.get_text_width_height_descent(line, font, ismath=False)[0] for line in sorted(lines)]
    return max(widths, default=0.0) / 72.0


def save(figure: Figure, path: Path) -> None:
    """Write a figure in the format of its suffix; raises UsageError for an unknown one, CdtoolError if it cannot."""
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise UsageError(f"{plain(path)} does not name a figure", f"a name that ends in {', '.join(SUFFIXES)}")
    write_bytes(path, encoded(figure, suffix))


def encoded(figure: Figure, suffix: str) -> bytes:
    """Return a figure in the format of a suffix of `SUFFIXES`; equal figures give equal bytes."""
    from importlib import import_module

    canvas = import_module(_BACKENDS[suffix]).FigureCanvas(figure)
    drawn = BytesIO()
    with drawing():
        _settle(figure)
        getattr(canvas, f"print_{suffix[1:]}")(drawn, metadata=_METADATA[suffix])
    return drawn.getvalue()


def svg_text(figure: Figure) -> str:
    """Return a figure as SVG, to be put into a document."""
    return encoded(figure, ".svg").decode("utf-8")


def write(
    axes: Axes,
    text: str,
    at: tuple[float, float],
    offset: tuple[float, float],
    frame: Any = "axes fraction",
    **look: Any,
) -> None:
    """Write a text at a position in `frame`, moved by `offset` [points]; never clipped. `look`: size, weight, side."""
    axes.annotate(text, at, xycoords=frame, xytext=offset, textcoords="offset points", annotation_clip=False, **look)


def label(text: object, length: int = 40) -> str:
    """Return a text from a file as a figure shows it: plain and at most `length` characters."""
    return shorten(plain(text), length)


def log_label(name: str, length: int = 60) -> str:
    """Return a log's name for a figure: as it was given, of an absolute path its last two parts."""
    return label("/".join(PurePath(name).parts[-2:]) if PurePath(name).is_absolute() else name, length)


def between(low: float, high: float, digits: int = 3) -> str:
    """Return a number, or the smallest and largest of several: 38.0 to 41.0."""
    first, last = number(low, digits), number(high, digits)
    return first if first == last else f"{first} to {last}"


def unit_label(unit: str) -> str:
    """Return a unit in its printed form."""
    return label({"m/s2": "m/s²", "rad/s2": "rad/s²", "1": "–"}.get(unit, unit), 16)


def _settle(figure: Figure) -> None:
    """Arrange once and round: the solver's last bits differ between runs, and so would the bytes of an SVG."""
    from matplotlib.transforms import Bbox

    engine = figure.get_layout_engine()
    if engine is None or not figure.axes:
        return
    engine.execute(figure)
    figure.set_layout_engine("none")
    for axes in figure.axes:
        axes.set_position(Bbox.from_bounds(*(round(value, 6) for value in axes.get_position().bounds)))
    title = figure._suptitle  # type: ignore[attr-defined]
    if title is not None:
        x, y = title.get_position()
        title.set_position((round(x, 6), round(y, 6)))


def slug(name: str, taken: set[str]) -> str:
    """Return a group or detector as part of a file name: letters, digits, hyphens; new among `taken`, and added."""
    letters = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    base = re.sub(r"[^a-z0-9]+", "-", letters.lower())[:40].strip("-") or "unnamed"
    found, number = base, 1
    while found in taken:
        number += 1
        found = f"{base}-{number}"
    taken.add(found)
    return found


def described(figure: Figure, description: str) -> Figure:
    """Return a figure with a description for readers who do not see it."""
    figure.description = description  # type: ignore[attr-defined]
    return figure
