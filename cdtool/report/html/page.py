"""The report as one HTML file that loads no other: tables, plots drawn by its own script, traces of single recordings.

Conventions: text from logs is escaped by the template or put into the page as text by the script, never as markup. A
content security policy allows only this script and this style, by their hashes.
"""

from __future__ import annotations

import base64
import hashlib
import json
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cdtool.plain_text import counted
from cdtool.report.html.page_tables import PageTable, classes, visible
from cdtool.report.html.plots import plot_data, traces_of
from cdtool.report.html.traces import plot_height, trace_data
from cdtool.report.model import NO_CERTIFICATE, TITLES, TITLES_OF_MANY
from cdtool.report.writers.base import Report

if TYPE_CHECKING:
    from jinja2 import Template
    from markupsafe import Markup

_FOLDER = Path(__file__).with_name("page_files")
# Lines under the headline.
_REASONS = 10
# The model's tables that the page shows; single contacts are in its recordings and their traces.
_TABLES = (
    *(
        "not_met",
        "met",
        "results",
        "kinds",
        "injected",
        "comparisons",
        "force",
        "points",
        "forces",
        "recordings",
        "cases",
    ),
    *("not_assessable", "skipped", "damaged", "findings", "calibration"),
)
_TEMPLATE, _STYLE = "report.html.j2", "report.css"
# In the order in which they use one another.
_SCRIPTS = (
    *("scales.js", "chart.js", "legend.js", "plots.js", "histogram.js", "forces.js", "trace.js", "tables.js"),
    "report.js",
)
# JSON inside a page must not end its script element, nor its line where a script is read.
_ESCAPES = str.maketrans({character: f"\\u{ord(character):04x}" for character in "<>&\u2028\u2029"})


def to_html(report: Report) -> str:
    """Return the whole report; the same text for the same input."""
    from markupsafe import Markup

    model, results, traces = report.model, report.evaluated.results, report.traces
    style, script = _read(_STYLE), "\n".join(_read(name) for name in _SCRIPTS)
    of_logs, numbers = traces_of(results, traces), {name: i for i, name in enumerate(results.detectors)}
    tables = {name: PageTable(model.tables[name], of_logs) if name in model.tables else None for name in _TABLES}
    plots = plot_data(report)
    paged = [table.values() for table in tables.values() if table and table.paged]
    return _template().render(
        policy=_policy(script, style),
        style=Markup(style),
        script=Markup(script),
        data=_json({**plots, "tables": paged}),
        traces=[_json(trace_data(trace, numbers)) for trace in traces],
        trace_height=plot_height(traces[0]) if traces else 0,
        kept=f"{counted(len(traces), 'trigger plot')} of {counted(len(results.recordings), 'recording')}",
        model=model,
        titles=TITLES | (TITLES_OF_MANY if "cases" in model.tables else {}),
        certificate=NO_CERTIFICATE,
        tables=tables,
        provenance=[PageTable(table, {}) for table in model.provenance],
        plots=plots,
        reasons=model.first_reasons(_REASONS),
        classes=classes,
    )


def _policy(script: str, style: str) -> str:
    return (
        f"default-src 'none'; script-src '{_hash(script)}'; style-src '{_hash(style)}'; img-src data:; "
        "base-uri 'none'; form-action 'none'"
    )


def _hash(text: str) -> str:
    return f"sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}"


def _json(values: Any) -> Markup:
    """Return strict JSON that may be part of a script element; its texts are plain already."""
    from markupsafe import Markup

    text = json.dumps(values, allow_nan=False, ensure_ascii=False, separators=(",", ":"))
    return Markup(text.translate(_ESCAPES))


@cache
def _read(name: str) -> str:
    return (_FOLDER / name).read_text(encoding="utf-8")


@cache
def _template() -> Template:
    from jinja2 import Environment, StrictUndefined
    from markupsafe import Markup

    def harmless(value: object) -> object:
        return visible(value) if isinstance(value, str) and not isinstance(value, Markup) else value

    environment = Environment(
        autoescape=True, undefined=StrictUndefined, finalize=harmless, trim_blocks=True, lstrip_blocks=True
    )
    return environment.from_string(_read(_TEMPLATE))
