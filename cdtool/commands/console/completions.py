"""The values that a shell completes with the Tab key, after `cdtool --install-completion`."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from importlib import import_module

Complete = Callable[[str], list[str]]

# So many folders, each the only entry of the one above, are entered at once.
_DEEPEST = 20


def detectors(incomplete: str) -> list[str]:
    """Return the detectors' names and short names that begin with the typed text."""
    from cdtool.detectors import DETECTORS

    return _beginning(incomplete, [*DETECTORS.usable_names(), *DETECTORS.short_names])


def detector_list(incomplete: str) -> list[str]:
    """Return the completions of the last name of a comma-separated list of detectors."""
    return _last_of_list(incomplete, detectors)


def thresholds(incomplete: str) -> list[str]:
    """Return the thresholds' names that begin with the typed text."""
    from cdtool.thresholds import THRESHOLDS

    return _beginning(incomplete, THRESHOLDS.usable_names())


def settings(incomplete: str) -> list[str]:
    """Return the keys of the benchmark file that begin with the typed text, each with the = before its value."""
    from cdtool.commands.judging.settings_table import JudgingTable
    from cdtool.commands.scoring.benchmark_file import SECTIONS

    section = incomplete.partition(".")[0]
    if section in ("inject", "tune"):
        return _beginning(incomplete, _keys(SECTIONS.load(section).table, f"{section}."))
    return _beginning(incomplete, [*_keys(JudgingTable), "threshold.name="])


def keys(place: str) -> Complete:
    """Return the completion of the keys of a model, named as module:Class, each with the = before its value."""
    module, _, attribute = place.partition(":")
    return lambda incomplete: _beginning(incomplete, _keys(getattr(import_module(module), attribute)))


def _keys(model: object, prefix: str = "") -> Iterable[str]:
    from cdtool.base.settings import alternatives, bare_type, is_model, keys_of

    for name, key in keys_of(model).items():
        tables = [bare_type(part) for part in alternatives(key.hint) if is_model(bare_type(part))]
        yield from (f"{prefix}{name}=",) if not tables else _keys(tables[0], f"{prefix}{name}.")


def operations(incomplete: str) -> list[str]:
    """Return the ways to divide a log that begin with the typed text."""
    from cdtool.recordings.operations import HOW_TO_CUT

    return _beginning(incomplete, HOW_TO_CUT)


def rules(incomplete: str) -> list[str]:
    """Return the signature's rules that begin with the typed text."""
    from cdtool.thresholds.fitted_signature import RULES

    return _beginning(incomplete, RULES)


def sides(incomplete: str) -> list[str]:
    """Return the sides that begin with the typed text."""
    from cdtool.thresholds.fitted_signature import SIDES

    return _beginning(incomplete, SIDES)


def alignments(incomplete: str) -> list[str]:
    """Return the alignments that begin with the typed text."""
    from cdtool.recordings.motion.progress import ALIGNMENTS

    return _beginning(incomplete, ALIGNMENTS)


def one_of(known: Iterable[str]) -> Complete:
    """Return the completion of one of the known values."""
    return lambda incomplete: _beginning(incomplete, known)


def files(*suffixes: str) -> Complete:
    """Return the completion of files with these suffixes and of folders; a folder without a choice is entered.

    Nothing for an address such as s3://: a network is not asked while a key is pressed. Without a match a shell
    completes any file.
    """
    return lambda incomplete: [] if "://" in incomplete else _paths(incomplete, suffixes)


def _paths(incomplete: str, suffixes: tuple[str, ...]) -> list[str]:
    for _ in range(_DEEPEST):
        folder, separator, typed = incomplete.rpartition("/")
        base = f"{folder}{separator}"
        try:
            with os.scandir(base or ".") as entries:
                found = [
                    f"{base}{entry.name}{'/' * _is_folder(entry, suffixes)}"
                    for entry in entries
                    if entry.name.startswith(typed) and (typed.startswith(".") or not entry.name.startswith("."))
                    if entry.name.lower().endswith(suffixes) or entry.is_dir()
                ]
        except OSError:
            return []
        if len(found) != 1 or not found[0].endswith("/"):
            return sorted(found)
        incomplete = found[0]
    return [incomplete]


def _is_folder(entry: os.DirEntry[str], suffixes: tuple[str, ...]) -> bool:
    """Return whether a folder is entered; results.parquet is named as it is."""
    return entry.is_dir() and not entry.name.lower().endswith(suffixes)


def _last_of_list(incomplete: str, complete: Complete) -> list[str]:
    before, comma, last = incomplete.rpartition(",")
    return [f"{before}{comma}{name}" for name in complete(last) if name not in before.split(",")]


def _beginning(incomplete: str, names: Iterable[str]) -> list[str]:
    return [name for name in names if name.startswith(incomplete)]
