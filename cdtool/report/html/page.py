"""The report as one HTML file that loads no other: tables, plots drawn by its own script, traces of single recordings.

Conventions: text from logs is escaped by the template or put into the page as text by the script, never as markup. A
content security policy allows only this script and this style, by their hashes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from cdtool.base.plain_text import LISTED, counted
from cdtool.report.html.page_tables import PageTable, classes
from cdtool.report.html.plots import plot_data, traces_of
from cdtool.report.html.self_contained import content_policy, page_part, page_template, script_json, style_sheet
from cdtool.report.html.traces import plot_height, trace_data
from cdtool.report.model import TITLES, TITLES_OF_MANY
from cdtool.report.plots.trace_words import LatencyTexts
from cdtool.report.table import Log
from cdtool.report.tables.attention import failed_traces
from cdtool.report.writers.base import Report

# The model's tables that the page shows; single contacts are in its recordings and their traces.
_TABLES = (
    *("attention", "not_met", "met", "results", "all_results", "kinds", "conditions", "injected", "comparisons"),
    *("force", "points", "forces", "recordings", "cases", "not_assessable"),
    *("skipped", "damaged", "findings", "calibration"),
)
_TEMPLATE = "report.html.j2"
# In the order in which they use one another.
_SCRIPTS = (
    *("scales.js", "chart.js", "legend.js", "plots.js", "histogram.js", "forces.js", "trace.js", "print.js"),
    *("tables.js", "report.js"),
)


def to_html(report: Report) -> str:
    """Return the whole report; the same text for the same input."""
    from markupsafe import Markup

    model, results, traces = report.model, report.evaluated.results, report.traces
    style, script = style_sheet(), "\n".join(page_part(name) for name in _SCRIPTS)
    of_logs, numbers = traces_of(traces), {name: i for i, name in enumerate(results.detectors)}
    tables = {name: PageTable(model.tables[name], of_logs) if name in model.tables else None for name in _TABLES}
    plots, texts = plot_data(report), LatencyTexts.of(results)
    failed = failed_traces(model.failed, traces, of_logs)
    paged = [table.values() for table in tables.values() if table and table.paged]
    return page_template(_TEMPLATE).render(
        policy=content_policy(style, script),
        style=Markup(style),
        script=Markup(script),
        data=script_json({**plots, "tables": paged, "failed": failed}),
        traces=[script_json(trace_data(trace, numbers, texts)) for trace in traces],
        trace_height=plot_height(traces[0]) if traces else 0,
        kept=f"{counted(len(traces), 'trigger plot')} of {counted(len(results.recordings), 'recording')}",
        printed=_printed(model.failed, of_logs),
        model=model,
        titles=TITLES | (TITLES_OF_MANY if "cases" in model.tables else {}),
        tables=tables,
        provenance=[PageTable(table, {}) for table in model.provenance],
        plots=plots,
        reasons=model.first_reasons(LISTED),
        best=model.tables["best"].rows if "best" in model.tables else (),
        classes=classes,
    )


def _printed(failed: Sequence[Log], of_logs: Mapping[Log, Sequence[int]]) -> str:
    """Return of how many failed recordings the trigger plots are printed; empty if nothing failed."""
    if not failed:
        return ""
    plotted = sum(bool(of_logs.get(log)) for log in failed)
    words = f"{plotted} of {counted(len(failed), 'failed recording')} have trigger plots."
    left_out = " The others are listed above; no curves were kept of them." if plotted < len(failed) else ""
    return f"{words}{left_out} Detectors that detected the contact are left out where a plot has five others."
