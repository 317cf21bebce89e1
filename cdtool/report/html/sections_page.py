"""A page of sections, one file without script: tables, figures as data URIs, and notes.

Text from logs and files is escaped by the template. A content security policy allows only this style and the figures.
"""

from __future__ import annotations

import base64
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from cdtool.base.errors import CdtoolError
from cdtool.report.html.page_tables import classes, visible
from cdtool.report.html.self_contained import content_policy, page_template, style_sheet
from cdtool.report.plots.figures import encoded
from cdtool.report.table import Cell, Heading, Table, name_cell
from cdtool.results.results import RecordingFinding, Skipped

if TYPE_CHECKING:
    from matplotlib.figure import Figure


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


@dataclass(frozen=True)
class SectionsPage:
    """Everything that the template shows; `kind` begins the title of the window, by which the file is recognised."""

    kind: str
    title: str
    headline: str
    counts: str
    tone: str
    scope: tuple[str, ...]
    sections: tuple[PageSection, ...]

    def html(self) -> str:
        """Return the page."""
        from markupsafe import Markup

        style = style_sheet("img {\n  max-width: 100%;\n  height: auto;\n  background: #ffffff;\n}\n")
        template = page_template("sections.html.j2")
        return template.render(page=self, style=Markup(style), policy=content_policy(style), classes=classes)


def images_of(figures: Sequence[tuple[Callable[[], Figure], str]]) -> tuple[PageImage, ...]:
    """Return figures with their captions as images; one that cannot be drawn is left out."""
    images = []
    for draw, caption in figures:
        try:
            figure = draw()
        except CdtoolError:  # a figure that cannot be drawn does not cost the page
            continue
        picture = encoded(figure, ".png")
        source = f"data:image/png;base64,{base64.b64encode(picture).decode()}"
        # A figure of 120 dots per inch is shown with 96 CSS pixels per inch.
        images.append(PageImage(source, caption, round(figure.get_figwidth() * 96.0)))
    return tuple(images)


def left_out_sections(skipped: Sequence[Skipped], findings: Sequence[RecordingFinding]) -> list[PageSection]:
    """Return a section with what was left out and the warnings; without tables if there is nothing."""
    tables = []
    for name, title, items in (("skipped", "Left out", skipped), ("findings", "Warnings", findings)):
        if items:
            rows = [[name_cell(visible(item.recording)), Cell(visible(item.reason))] for item in items]
            tables.append(Table(name, title, (Heading("recording"), Heading("reason")), rows))
    return [PageSection("Left out and warnings", tuple(tables))]
