"""The values that a shell completes with the Tab key, after `cdtool --install-completion`; files are its own."""

from __future__ import annotations

from collections.abc import Callable, Iterable

Complete = Callable[[str], list[str]]


def detectors(incomplete: str) -> list[str]:
    """Return the detectors' names and short names that begin with the typed text."""
    from cdtool.detectors import DETECTORS

    return _beginning(incomplete, [*DETECTORS.usable_names(), *DETECTORS.short_names])


def detector_list(incomplete: str) -> list[str]:
    """Return the completions of the last name of a comma-separated list of detectors."""
    return _last_of_list(incomplete, detectors)


def one_of(known: Iterable[str]) -> Complete:
    """Return the completion of one of the known values."""
    return lambda incomplete: _beginning(incomplete, known)


def _last_of_list(incomplete: str, complete: Complete) -> list[str]:
    before, comma, last = incomplete.rpartition(",")
    return [f"{before}{comma}{name}" for name in complete(last) if name not in before.split(",")]


def _beginning(incomplete: str, names: Iterable[str]) -> list[str]:
    return [name for name in names if name.startswith(incomplete)]
