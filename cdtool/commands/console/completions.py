"""The values that a shell completes with the Tab key, after `cdtool --install-completion`; files are its own."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from importlib import import_module

import typer

Complete = Callable[[str], list[str]]
CompleteIn = Callable[[typer.Context, str], list[str]]


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


def _last_of_list(incomplete: str, complete: Complete) -> list[str]:
    before, comma, last = incomplete.rpartition(",")
    return [f"{before}{comma}{name}" for name in complete(last) if name not in before.split(",")]


def _beginning(incomplete: str, names: Iterable[str]) -> list[str]:
    return [name for name in names if name.startswith(incomplete)]
