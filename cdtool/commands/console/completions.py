"""The values that a shell completes with the Tab key, after `cdtool --install-completion`."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from importlib import import_module

import typer

Complete = Callable[[str], list[str]]
CompleteIn = Callable[[typer.Context, str], list[str]]

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


def keys(place: str) -> CompleteIn:
    """Return the completion of --set by the keys of a model, named as module:Class, then by a key's words."""

    def complete(context: typer.Context, incomplete: str) -> list[str]:
        from cdtool.commands.scoring.benchmark_file import SECTIONS, readers_of

        module, _, attribute = place.partition(":")
        known = dict(_words_by_key(getattr(import_module(module), attribute), ""))
        section = incomplete.partition(".")[0]
        if section in SECTIONS.names():
            known |= _words_by_key(SECTIONS.load(section).table, f"{section}.")
        if (command := context.command.name) in readers_of("machine"):  # of a benchmark file
            known = {key: words for key, words in known.items() if command in readers_of(key)}
        key, equals, typed = incomplete.partition("=")
        return (
            [f"{key}={word}" for word in _beginning(typed, known.get(key, ()))]
            if equals
            else _beginning(incomplete, [f"{name}=" for name in known])
        )

    return complete


def _words_by_key(model: object, prefix: str) -> Iterable[tuple[str, Iterable[str]]]:
    """Return each full key of a model with the words that it may have; empty if it may have others."""
    from cdtool.base.settings import alternatives, bare_type, is_model, keys_of, words_of
    from cdtool.recordings.operations import HOW_TO_CUT
    from cdtool.thresholds import THRESHOLDS

    known = {"operations": HOW_TO_CUT, "threshold": THRESHOLDS.usable_names()}
    for name, key in keys_of(model).items():
        parts = alternatives(key.hint)
        tables = [bare_type(part) for part in parts if is_model(bare_type(part))]
        if name in known:
            yield name, known[name]
        elif tables:
            yield from _words_by_key(tables[0], f"{prefix}{name}.")
        else:
            switch = ("true", "false") if any(bare_type(part) is bool for part in parts) else ()
            yield f"{prefix}{name}", [*switch, *(word for part in parts for word in words_of(part))]
    if "threshold" in keys_of(model):
        yield "threshold.name", known["threshold"]


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
