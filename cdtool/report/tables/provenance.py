"""Tables of how a benchmark's results were produced: rules, detectors, force profiles, recordings learned from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from cdtool.report.many import most_rows
from cdtool.report.number_text import NOTHING
from cdtool.report.table import Cell, Heading, Row, Table, name_cell, shown
from cdtool.report.tables.results import detector_cell, part_of
from cdtool.results.results import Results

_NAMES = {
    "tool_version": "cdtool version",
    "machine": "machine",
    "simulated": "recordings simulated",
    "watched_joints": "joints monitored, of all",
    "threshold": "threshold",
    "threshold_rule": "rule of the threshold",
    "signature_rule": "rule of the normal band",
    "safety_factor_set": "safety factor or limits set",
    "false_alarm_budget": "false-alarm budget",
    "operations": "operations cut by",
    "window_s": "matching window [s]",
    "debounce_samples": "debounce [samples]",
    "rearm_s": "re-armed after [s]",
    "hysteresis": "hysteresis, share of the safety factor",
    "latch": "alarms latch",
    "onset": "onset of a contact",
    "force": "force from several axes",
    "separation_s": "separation of contacts [s]",
    "label_file": "label file",
    "not_contacts": "kinds of labels that are not contacts",
    "synchronisation_s": "synchronisation of the load cell [s]",
    "mass_before_cell_kg": "mass before the load cell [kg]",
    "benchmark_sha256": "SHA-256 of the benchmark file",
    "machine_sha256": "SHA-256 of the machine file",
    "plugins": "plug-ins",
    "learned_runs": "operations learned from",
    "learned_until": "learned from each log until",
    "learned_sections": "parts of logs learned from",
    "scored_without_own_part": "scored with thresholds learned from the other recordings",
    "sections": "parts of logs scored",
}
# Items of a list in one cell.
_MOST_IN_CELL = 1000
# Entries that have tables of their own, are part of another, or are the same in every report.
_OTHER_TABLES = (
    *("tool", "gains", "signature_sha256", "learned_sha256", "load_cell_sha256", "units", "short_names"),
    "force_profiles",
)


def provenance_tables(results: Results) -> list[Table]:
    """Return every entry of the provenance; entries that this version does not know keep their own names."""
    provenance = results.provenance
    entries = [
        (Cell(_NAMES.get(key, shown(key))), Cell(_in_words(value)))
        for key, value in provenance.items()
        if key not in _OTHER_TABLES and value not in (None, "", {}, [])
    ]
    learned = [(name_cell(name), Cell(str(digest))) for name, digest in part_of(provenance, "learned_sha256").items()]
    cells = [(name_cell(name), Cell(str(digest))) for name, digest in part_of(provenance, "load_cell_sha256").items()]
    made = (
        _table("provenance", "Provenance", ("entry", "value"), entries),
        _table("gains", "Detectors", ("detector", "unit", "gains", "SHA-256 of its threshold"), _gains(results)),
        _table("profiles", "Force profiles", ("group", "profile", "limits", "source", "note"), _profiles(provenance)),
        _table("learned", "Recordings learned from", ("recording", "SHA-256"), learned),
        _table("load_cells", "Load cells in files of their own", ("recording and file", "SHA-256"), cells),
    )
    most = most_rows(results)
    return [
        replace(table, rows=table.rows[:most], more=len(table.rows[most or len(table.rows) :]))
        for table in made
        if table.rows
    ]


def _table(name: str, title: str, headings: Sequence[str], rows: Sequence[Row]) -> Table:
    return Table(name, title, [Heading(heading) for heading in headings], rows, "provenance")


def _gains(results: Results) -> list[Row]:
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


def _profiles(provenance: Mapping[str, Any]) -> list[Row]:
    keys = ("title", "steps", "source", "note")
    return [
        (name_cell(group), *(Cell(_in_words(profile.get(key, NOTHING))) for key in keys))
        for group, profile in part_of(provenance, "force_profiles").items()
        if isinstance(profile, Mapping)
    ]


def _in_words(value: object) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{key} = {_in_words(item)}" for key, item in value.items()) or NOTHING
    if isinstance(value, Sequence) and not isinstance(value, str):
        more = [f"and {len(value) - _MOST_IN_CELL} more"] if len(value) > _MOST_IN_CELL else []
        return "; ".join((*map(_in_words, value[:_MOST_IN_CELL]), *more)) or NOTHING
    return str(value) or NOTHING
