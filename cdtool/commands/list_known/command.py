"""`cdtool list`."""

from __future__ import annotations

from dataclasses import MISSING, fields, is_dataclass
from typing import Annotated, Any

import typer

from cdtool.base.errors import UsageError, nearest
from cdtool.commands.console.completions import one_of
from cdtool.commands.console.console import leave, number, print_json, print_line, print_skipped, table
from cdtool.commands.console.options import JsonOption

_KINDS = ("detectors", "thresholds", "machines", "formats", "writers")


def list_known(
    kind: Annotated[
        str,
        typer.Argument(
            help="detectors, thresholds, machines, formats or writers.", metavar="KIND", autocompletion=one_of(_KINDS)
        ),
    ],
    as_json: JsonOption = False,
) -> None:
    """List the available detectors (with gains), thresholds, machines, formats or report writers, including plug-ins.

    Example: cdtool list detectors --json
    """
    from cdtool.results.results import Skipped

    if kind not in _KINDS:
        raise UsageError(f"unknown kind '{kind}'", nearest(kind, _KINDS))
    registry = _registry(kind)
    broken = [Skipped(name, str(fault)) for name, fault in registry.broken_plugins().items()]
    entries = [_entry(kind, name) for name in registry.usable_names()]
    print_skipped(broken)
    if as_json:
        print_json(entries)
    elif kind == "detectors":
        _show_detectors(entries)
    else:
        table([("name", "left"), ("description", "left")], [(entry["name"], entry["summary"]) for entry in entries])
    leave(broken)


def _registry(kind: str) -> Any:
    from cdtool.detectors import DETECTORS
    from cdtool.formats import FORMATS
    from cdtool.machines import MACHINES
    from cdtool.report.writers import WRITERS
    from cdtool.thresholds import THRESHOLDS

    return dict(zip(_KINDS, (DETECTORS, THRESHOLDS, MACHINES, FORMATS, WRITERS), strict=True))[kind]


def _entry(kind: str, name: str) -> dict[str, Any]:
    loaded = _registry(kind).load(name)
    entry: dict[str, Any] = {"name": name, "summary": (loaded.__doc__ or "").strip().split("\n")[0]}
    if kind == "detectors":
        entry |= {"short_name": loaded.short_name, "title": loaded.title, "needs": list(loaded.needs)}
        entry["gains"] = [{"name": item.name, "default": item.default, **item.metadata} for item in fields(loaded)]
    elif kind in ("formats", "writers"):
        entry["suffixes"] = list(loaded.suffixes)
    elif is_dataclass(loaded):
        entry["settings"] = [
            {"name": item.name, "default": None if item.default is MISSING else item.default} for item in fields(loaded)
        ]
    return entry


def _show_detectors(entries: list[dict[str, Any]]) -> None:
    for entry in entries:
        print_line(f"{entry['name']} ({entry['short_name']}): {entry['title']}; needs {', '.join(entry['needs'])}")
        for gain in entry["gains"]:
            unit = "" if gain["unit"] == "1" else f" {gain['unit']}"
            print_line(f"    {gain['name']} = {number(gain['default'], 4)}{unit}")
            print_line(f"        {gain['meaning']}")
