"""The protocol as one HTML file that loads no other and runs no script; it prints as A4."""

from __future__ import annotations

import base64
import re
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from cdtool.commands.protocol.document.blocks import Document
from cdtool.report.html.self_contained import content_policy

if TYPE_CHECKING:
    from jinja2 import Template
    from markupsafe import Markup

_FOLDER = Path(__file__).with_name("page_files")
# After a sign between two characters, and between 24 others: as in protocol.typ.
_BREAKS = re.compile(r"(?<=[/_])(?=\S)|(?<=\S{24})(?=\S{8})")


def to_html(document: Document) -> str:
    """Return the page of a document; the same text for the same document."""
    from markupsafe import Markup

    number = document.page.replace("{page}", '" counter(page) "').replace("{pages}", '" counter(pages) "')
    on_paper = f'@bottom-left {{ content: "{document.data_hash}" }} @bottom-right {{ content: "{number}" }}'
    style = f"{page_file('protocol.css')}@page {{ {on_paper} }}"
    return _template().render(document=document, policy=content_policy(style), style=Markup(style))


@cache
def page_file(name: str) -> str:
    """Return the text of a file of the protocol's pages."""
    return (_FOLDER / name).read_text(encoding="utf-8")


@cache
def _template() -> Template:
    from jinja2 import Environment, StrictUndefined

    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    environment.filters |= {"breakable": _breakable, "data_url": _data_url}
    return environment.from_string(page_file("protocol.html.j2"))


def _breakable(text: str) -> Markup:
    """Return a text as markup, with places to break after the signs of file names and within what is very long."""
    from markupsafe import Markup, escape

    parts = _BREAKS.split(text)
    return Markup("<wbr>").join(escape(part) for part in parts if part)


def _data_url(svg: str) -> str:
    return f"data:image/svg+xml;base64,{base64.b64encode(svg.encode()).decode()}"
