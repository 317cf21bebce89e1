"""The values that a shell completes with the Tab key, after `cdtool --install-completion`."""

from __future__ import annotations

from collections.abc import Callable, Iterable

Complete = Callable[[str], list[str]]


def detectors(incomplete: str) -> list[str]:
    """Return the detectors' names and short names that begin with the typed text."""
    from cdtool.detectors import DETECTORS

    return _beginning(incomplete, [*DETECTORS.usable_names(), *DETECTORS.short_names])


def detector_list(incomplete: str) -> list[str]:
    """Return the completions of the last name of a comma-separated list of detectors."""
    before, comma, last = incomplete.rpartition(",")
    return [f"{before}{comma}{name}" for name in detectors(last) if name not in before.split(",")]


def thresholds(incomplete: str) -> list[str]:
    """Return the thresholds' names that begin with the typed text."""
    from cdtool.thresholds import THRESHOLDS

    return _beginning(incomplete, THRESHOLDS.usable_names())


def operations(incomplete: str) -> list[str]:
    """Return the ways to divide a log that begin with the typed text."""
    from cdtool.operations import HOW_TO_CUT

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
    from cdtool.motion.progress import ALIGNMENTS

    return _beginning(incomplete, ALIGNMENTS)


def one_of(known: Iterable[str]) -> Complete:
    """Return the completion of one of the known values."""
    return lambda incomplete: _beginning(incomplete, known)


def _beginning(incomplete: str, names: Iterable[str]) -> list[str]:
    return [name for name in names if name.startswith(incomplete)]
