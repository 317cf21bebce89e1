"""The parts of a protocol document, from which both its HTML and its PDF are made."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Level = Literal[1, 2]


@dataclass(frozen=True)
class SectionHeading:
    """A heading; `page_break`: it begins a new page. `keep`: all up to the next heading stays on one page."""

    text: str
    level: Level = 1
    page_break: bool = False
    keep: bool = False
    kind: Literal["heading"] = "heading"


@dataclass(frozen=True)
class Paragraph:
    """A paragraph; `look`: as body text, as a small note, or as typed text."""

    text: str
    look: Literal["body", "note", "code"] = "body"
    kind: Literal["paragraph"] = "paragraph"


@dataclass(frozen=True)
class VerdictBox:
    """The verdict, large, with its sentence; `outcome` sets the colour, which never stands alone."""

    outcome: str
    label: str
    text: str
    kind: Literal["verdict"] = "verdict"


@dataclass(frozen=True)
class Items:
    """A list of sentences."""

    items: tuple[str, ...]
    kind: Literal["items"] = "items"


@dataclass(frozen=True)
class Facts:
    """Labels with their values, in one or more columns."""

    rows: tuple[tuple[str, str], ...]
    columns: int = 1
    kind: Literal["facts"] = "facts"


@dataclass(frozen=True)
class HeadedTable:
    """A table with a heading row; `numeric` columns are right-aligned, `strong` rows emphasised.

    `typed`: columns of hashes.
    """

    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numeric: tuple[bool, ...]
    strong: tuple[int, ...] = ()
    typed: tuple[int, ...] = ()
    kind: Literal["grid"] = "grid"


@dataclass(frozen=True)
class CurveDrawing:
    """A drawing of force-time curves as SVG, with a description for readers who do not see it."""

    svg: str
    alt: str
    kind: Literal["curves"] = "curves"


@dataclass(frozen=True)
class Signatures:
    """Lines to sign: for each person the role, and the labels of the lines."""

    people: tuple[tuple[str, str], ...]
    place_date: str
    signature: str
    kind: Literal["signatures"] = "signatures"


Block = SectionHeading | Paragraph | VerdictBox | Items | Facts | HeadedTable | CurveDrawing | Signatures


@dataclass(frozen=True)
class Document:
    """A whole document: title, number, language, what stands on every page, and its parts.

    `page` is the text "page x of y" with the placeholders {page} and {pages}; `day` is the day of the test as (year,
    month, day), the only date in the file.
    """

    title: str
    number: str
    language: str
    data_hash: str
    page: str
    day: tuple[int, int, int] | None
    blocks: tuple[Block, ...]
