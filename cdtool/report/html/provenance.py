"""The HTML report's provenance: tool, hashes, rules and gains that led to the figures."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from cdtool.evaluation.results import Results
from cdtool.report.figure_text import NOTHING
from cdtool.report.html.table import Cell, Column, Table, shown
from cdtool.report.html.tables import detector_cell, part_of

_WORDS = {
    "tool": "tool",
    "tool_version": "its version",
    "machine": "machine",
    "watched_joints": "joints watched, of all",
    "threshold": "threshold",
    "signature_rule": "how the normal band is made",
    "safety_factor_set": "safety factor or limits set",
    "false_alarm_budget": "false-alarm budget",
    "operations": "operations cut by",
    "window_s": "matching window [s]",
    "debounce_samples": "debounce [samples]",
    "rearm_s": "armed again after [s]",
    "hysteresis": "hysteresis, share of the safety factor",
    "latch": "alarms latch",
    "onset": "onset of a contact",
    "label_file": "label file",
    "synchronisation_s": "synchronisation of the load cell [s]",
    "mass_before_cell_kg": "mass before the load cell [kg]",
    "benchmark_sha256": "SHA-256 of the benchmark file",
    "machine_sha256": "SHA-256 of the machine file",
    "plugins": "plug-ins",
    "learned_runs": "operations learned from",
}
# These have tables of their own.
_APART = ("gains", "signature_sha256", "learned_sha256", "units", "short_names", "force_profiles")


def provenance_tables(results: Results) -> list[Table]:
    """Every entry of the provenance, those that this version does not know under their own names."""
    provenance = results.provenance
    entries = [(key, value) for key, value in provenance.items() if key not in _APART and value not in (None, "", {})]
    made = [
        _table(
            "provenance-table",
            "How the figures came about",
            ("what", "value"),
            [(Cell(_WORDS.get(key, shown(key))), Cell(_in_words(value))) for key, value in entries],
        ),
        _table(
            "gains-table",
            "Detectors",
            ("detector", "compared in", "gains", "SHA-256 of its threshold"),
            _gains(results),
        ),
        _table(
            "profiles-table", "Force profiles", ("group", "profile", "limits", "source", "note"), _profiles(provenance)
        ),
        _table(
            "learned-table",
            "Recordings learned from",
            ("recording", "SHA-256"),
            [(Cell(shown(name)), Cell(str(digest))) for name, digest in part_of(provenance, "learned_sha256").items()],
        ),
    ]
    return [table for table in made if table.rows]


def _table(name: str, caption: str, headings: Sequence[str], rows: Sequence[Sequence[Cell]]) -> Table:
    return Table(name, caption, [Column(heading) for heading in headings], rows)


def _gains(results: Results) -> list[Sequence[Cell]]:
    units, digests = (part_of(results.provenance, key) for key in ("units", "signature_sha256"))
    return [
        (
            detector_cell(results, name),
            Cell(str(units.get(name, NOTHING))),
            Cell(_in_words(gains)),
            Cell(str(digests.get(name, NOTHING))),
        )
        for name, gains in part_of(results.provenance, "gains").items()
    ]


def _profiles(provenance: Mapping[str, Any]) -> list[Sequence[Cell]]:
    return [
        (
            Cell(shown(group)),
            *(Cell(_in_words(profile.get(key, NOTHING))) for key in ("title", "steps", "source", "note")),
        )
        for group, profile in part_of(provenance, "force_profiles").items()
        if isinstance(profile, Mapping)
    ]


def _in_words(value: object) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{key} = {_in_words(item)}" for key, item in value.items()) or NOTHING
    if isinstance(value, Sequence) and not isinstance(value, str):
        return "; ".join(map(_in_words, value)) or NOTHING
    return str(value) or NOTHING
