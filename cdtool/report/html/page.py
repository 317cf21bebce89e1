"""The report as one HTML file that loads nothing: tables, plots drawn by its own script, traces of single recordings.

Conventions: text from logs is escaped by the template or put into the page as text by the script, never as markup. A
content security policy allows this script and this style alone, by their hashes.
"""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cdtool.evaluation.alike import Reason, alike
from cdtool.evaluation.evaluated import Evaluated
from cdtool.evaluation.results import DAMAGED, Results, onset_words
from cdtool.evaluation.traces.trace import Trace
from cdtool.plain_text import counted
from cdtool.report.few_contacts import explained
from cdtool.report.figure_text import NOTHING, number
from cdtool.report.html.plots import plot_data
from cdtool.report.html.recordings import not_judged_table, reasons_table, recordings_table, traces_of
from cdtool.report.html.table import Table, seen
from cdtool.report.html.tables import (
    calibration_table,
    comparisons_table,
    force_counts,
    force_table,
    limits_table,
    points_table,
    provenance_tables,
    summary_table,
)
from cdtool.report.html.traces import plot_height, trace_data
from cdtool.report.verdict_words import NO_CERTIFICATE, counts_words, tone, verdict_words

if TYPE_CHECKING:
    from jinja2 import Template
    from markupsafe import Markup

_FOLDER = Path(__file__).with_name("page_files")
# Lines under the headline.
_REASONS = 10
_TEMPLATE, _STYLE = "report.html.j2", "report.css"
# In the order in which they use one another.
_SCRIPTS = ("scales.js", "chart.js", "legend.js", "plots.js", "forces.js", "trace.js", "tables.js", "report.js")
# JSON inside a page must not end its script element, nor its line where a script is read.
_ESCAPES = str.maketrans({character: f"\\u{ord(character):04x}" for character in "<>&\u2028\u2029"})


def to_html(evaluated: Evaluated, traces: Sequence[Trace]) -> str:
    """The whole report; the same text for the same input."""
    from markupsafe import Markup

    results = evaluated.results
    style, script = _read(_STYLE), "\n".join(_read(name) for name in _SCRIPTS)
    opens = traces_of(results, traces)
    detectors = {name: i for i, name in enumerate(results.detectors)}
    tables = _tables(evaluated, opens)
    plots = plot_data(evaluated, traces)
    paged = [table.values() for table in tables.values() if table and table.paged]
    return _template().render(
        policy=_policy(script, style),
        style=Markup(style),
        script=Markup(script),
        data=_json({**plots, "tables": paged}),
        traces=[_json(trace_data(trace, detectors)) for trace in traces],
        trace_height=plot_height(traces[0]) if traces else 0,
        tables=tables,
        provenance=provenance_tables(results),
        plots=plots,
        verdict=verdict_words(evaluated),
        counts=counts_words(evaluated),
        tone=tone(evaluated),
        reasons=results.conclusion.reasons[:_REASONS],
        more_reasons=max(len(results.conclusion.reasons) - _REASONS, 0),
        certificate=NO_CERTIFICATE,
        lines=_lines(evaluated, traces),
        version=results.provenance.get("tool_version", ""),
        machine=results.provenance.get("machine", ""),
        NOTHING=NOTHING,
    )


def _tables(evaluated: Evaluated, opens: dict[tuple[str, str], list[int]]) -> dict[str, Table | None]:
    """The tables by what the template calls them; None where there are no rows."""
    results = evaluated.results
    made = {
        "limits": limits_table(results, met=False),
        "met": limits_table(results, met=True),
        "figures": summary_table(evaluated),
        "comparisons": comparisons_table(evaluated),
        "force_counts": force_counts(results),
        "forces": force_table(results, opens),
        "points": points_table(results),
        "recordings": recordings_table(results, opens),
        "not_judged": not_judged_table(results),
        "skipped": reasons_table("skipped-table", "Left out or lost", _left_out_or_lost(results)),
        "findings": reasons_table("findings-table", "Odd, but used", alike(results.warnings)),
        "calibration": calibration_table(results),
    }
    return {name: table if table.rows else None for name, table in made.items()}


def _left_out_or_lost(results: Results) -> list[Reason]:
    losses = (Reason(item.recording, f"{DAMAGED}: {item.reason}") for item in alike(results.losses))
    return [*alike(results.skipped), *losses]


def _lines(evaluated: Evaluated, traces: Sequence[Trace]) -> dict[str, str]:
    """Sentences that the template needs."""
    results = evaluated.results
    provenance = results.provenance
    lost = [*results.skipped, *results.losses]
    resolutions = [item.resolution_ms for item in results.contacts if item.resolution_ms is not None]
    return {
        "onset": onset_words(provenance),
        "few": explained(evaluated.summaries),
        "label_file": str(provenance.get("label_file") or ""),
        "resolution": f"{number(max(resolutions))} ms" if resolutions else "",
        "recordings": counted(len(results.recordings), "recording"),
        "detectors": counted(len(results.detectors), "detector"),
        "kept": f"{counted(len(traces), 'trigger plot')} of {counted(len(results.recordings), 'recording')}",
        "skipped": counted(len(lost), "entry") if lost else "",
    }


def _policy(script: str, style: str) -> str:
    return (
        f"default-src 'none'; script-src '{_hash(script)}'; style-src '{_hash(style)}'; img-src data:; "
        "base-uri 'none'; form-action 'none'"
    )


def _hash(text: str) -> str:
    return f"sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}"


def _json(values: Any) -> Markup:
    """Strict JSON that may stand in a script element; its texts are plain already."""
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
        return seen(value) if isinstance(value, str) and not isinstance(value, Markup) else value

    environment = Environment(
        autoescape=True, undefined=StrictUndefined, finalize=harmless, trim_blocks=True, lstrip_blocks=True
    )
    return environment.from_string(_read(_TEMPLATE))
