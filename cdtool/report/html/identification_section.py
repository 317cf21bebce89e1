"""A section of the page of an identification: tables, figures as data URIs, and a note."""

from __future__ import annotations

import base64
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from cdtool.errors import CdtoolError
from cdtool.report.plots.identification_plots import png
from cdtool.report.table import Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# A figure of 120 dots per inch is shown with so many CSS pixels per inch.
_PIXELS = 96.0


@dataclass(frozen=True)
class PageImage:
    """A figure as a data URI, with its caption and width [px]."""

    source: str
    caption: str
    width: int


@dataclass(frozen=True)
class PageSection:
    """A section of the page."""

    title: str
    tables: tuple[Table, ...] = ()
    images: tuple[PageImage, ...] = ()
    note: str = ""


def images_of(figures: Sequence[tuple[Callable[[], Figure], str]]) -> tuple[PageImage, ...]:
    """Return figures with their captions as images; one that cannot be drawn is left out."""
    images = []
    for draw, caption in figures:
        try:
            figure = draw()
        except CdtoolError:  # a figure that cannot be drawn does not cost the page
            continue
        source = f"data:image/png;base64,{base64.b64encode(png(figure)).decode()}"
        images.append(PageImage(source, caption, round(figure.get_figwidth() * _PIXELS)))
    return tuple(images)
