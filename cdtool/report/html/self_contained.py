"""What makes a page one file that runs nothing but its own script: its parts, template, content policy and data."""

from __future__ import annotations

import base64
import hashlib
import json
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cdtool.report.html.page_tables import visible
from cdtool.report.plots.style import page_colours

if TYPE_CHECKING:
    from jinja2 import Template
    from markupsafe import Markup

_FOLDER = Path(__file__).with_name("page_files")
# Characters that would end a script element or a line of it.
_ESCAPES = str.maketrans({character: f"\\u{ord(character):04x}" for character in "<>&\u2028\u2029"})


@cache
def page_part(name: str) -> str:
    """Return the text of a file of the pages: a style sheet, a script, a template."""
    return (_FOLDER / name).read_text(encoding="utf-8")


def style_sheet(more: str = "") -> str:
    """Return the style of all pages, with the colours of the figures, and more of a page's own."""
    return page_colours() + page_part("report.css") + more


@cache
def page_template(name: str) -> Template:
    """Return a template that escapes every text and shows characters that cannot be seen."""
    from jinja2 import Environment, FunctionLoader, StrictUndefined
    from markupsafe import Markup

    def harmless(value: object) -> object:
        return visible(value) if isinstance(value, str) and not isinstance(value, Markup) else value

    environment = Environment(
        loader=FunctionLoader(page_part),
        autoescape=True,
        undefined=StrictUndefined,
        finalize=harmless,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(name)


def content_policy(style: str, script: str | None = None) -> str:
    """Return the policy that allows this style and this script, by their digests, and nothing from elsewhere."""
    scripts = "" if script is None else f"script-src '{_digest(script)}'; "
    return (
        f"default-src 'none'; {scripts}style-src '{_digest(style)}'; img-src data:; base-uri 'none'; form-action 'none'"
    )


def script_json(values: Any) -> Markup:
    """Return strict JSON that may be part of a script element; its texts are plain already."""
    from markupsafe import Markup

    text = json.dumps(values, allow_nan=False, ensure_ascii=False, separators=(",", ":"))
    return Markup(text.translate(_ESCAPES))


def _digest(text: str) -> str:
    return f"sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}"
