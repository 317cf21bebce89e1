"""The results as Markdown: a table a group, how onsets were found, what was left out, where it all came from."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from urllib.parse import quote

from cdtool.evaluation.results import ExposureResult, Results, Skipped
from cdtool.evaluation.statistics import Summary, summarise
from cdtool.plain_text import plain

_ACTIVE = re.compile(r"([\\`*\[\]<>|&$#~:!]|(?<![A-Za-z0-9])_|_(?![A-Za-z0-9]))")
_FIGURES = ("mean ms", "std ms", "median ms", "n", "missed", "not assessable", "false alarms", "operations")
# Provenance in words; gains and hashes have tables of their own.
_ONE_LINE = (
    ("tool_version", "cdtool version"),
    ("machine", "machine"),
    ("watched_joints", "joints watched, of all"),
    ("threshold", "threshold"),
    ("operations", "operations cut by"),
    ("window_s", "matching window [s]"),
    ("debounce_samples", "debounce [samples]"),
    ("benchmark_sha256", "SHA-256 of the benchmark file"),
    ("machine_sha256", "SHA-256 of the machine file"),
)


@dataclass(frozen=True)
class Image:
    """A figure beside the report: its file name, caption, and group (None: of all groups)."""

    name: str
    caption: str
    group: str | None = None


def to_markdown(results: Results, images: Sequence[Image] = ()) -> str:
    """The report as GitHub-flavoured Markdown; text from files appears as it is and never as markup."""
    parts = ["# Collision detection: latency and false alarms"]
    parts.append(
        f"Latency: from contact onset ({escape(results.provenance.get('onset', 'rule not stated'))}) to alarm, "
        "debounce included. Mean, standard deviation and median are those of the n detected contacts; "
        "read them beside the missed and the not assessable ones."
    )
    parts += [_image(image) for image in images if image.group is None]
    summaries = summarise(results)
    for group in results.groups:
        parts.append(f"## {escape(group)}")
        parts.append(_group_table([item for item in summaries if item.group == group], results.provenance))
        parts += [_image(image) for image in images if image.group == group]
    blind = [item for item in results.exposure if item.not_judged]
    if blind:
        parts += ["## What could not be judged", _not_judged(blind)]
    if results.skipped:
        parts += ["## Left out", _reasons(results.skipped)]
    if results.findings:
        parts += ["## Findings", _reasons(results.findings)]
    parts += ["## Provenance", *_provenance(results.provenance)]
    return "\n\n".join(parts) + "\n"


def escape(text: object) -> str:
    """Text from a file so that Markdown shows it as it is: no markup, no link, no mention, no end of a table's row."""
    escaped = _ACTIVE.sub(r"\\\1", plain(text))
    return escaped.replace("@", "&#64;").replace("www.", "www&#46;")


def _group_table(rows: Sequence[Summary], provenance: Mapping[str, Any]) -> str:
    short = provenance.get("short_names", {})
    cells = [
        (
            escape(f"{row.detector} ({short[row.detector]})" if row.detector in short else row.detector),
            _number(row.mean_ms),
            _number(row.std_ms),
            _number(row.median_ms),
            *((row.detected, row.missed, row.not_assessable) if row.contacts else ("–", "–", "–")),
            row.false_alarms,
            row.operations,
        )
        for row in rows
    ]
    return _table(("detector", *_FIGURES), cells, numeric=True)


def _not_judged(items: Iterable[ExposureResult]) -> str:
    rows = [
        (
            escape(item.group),
            escape(item.detector),
            f"{100.0 * sum(item.not_judged.values()):.0f} %",
            escape(", ".join(f"{reason} {100.0 * share:.0f} %" for reason, share in item.not_judged.items())),
        )
        for item in items
    ]
    return _table(("group", "detector", "share of its samples", "why"), rows)


def _reasons(items: Iterable[Skipped]) -> str:
    rows = [(escape(item.recording), escape(item.reason.removeprefix(f"{item.recording}: "))) for item in items]
    return _table(("recording", "reason"), rows)


def _provenance(provenance: Mapping[str, Any]) -> list[str]:
    lines = [(words, escape(provenance[key])) for key, words in _ONE_LINE if provenance.get(key) is not None]
    parts = [_table(("what", "value"), lines)]
    gains = provenance.get("gains", {})
    signatures = provenance.get("signature_sha256", {})
    if gains:
        rows = [
            (
                escape(name),
                escape(", ".join(f"{gain} = {value}" for gain, value in values.items())),
                escape(signatures.get(name, "–")),
            )
            for name, values in gains.items()
        ]
        parts.append(_table(("detector", "gains", "SHA-256 of its threshold"), rows))
    logs = provenance.get("logs_sha256", {})
    if logs:
        parts.append(_table(("log", "SHA-256"), [(escape(name), escape(digest)) for name, digest in logs.items()]))
    return parts


def _table(headings: Sequence[str], rows: Sequence[Sequence[object]], *, numeric: bool = False) -> str:
    rule = ["---"] + ["---:" if numeric else "---"] * (len(headings) - 1)
    return "\n".join(f"| {' | '.join(str(cell) for cell in row)} |" for row in (headings, rule, *rows))


def _image(image: Image) -> str:
    return f"![{escape(image.caption)}]({quote(image.name)})"


def _number(value: float) -> str:
    """Three significant digits, without an exponent; a dash where there is no figure."""
    if not math.isfinite(value):
        return "–"
    digits = 2 - math.floor(math.log10(abs(value))) if value else 0
    return f"{value:.{max(digits, 0)}f}"
