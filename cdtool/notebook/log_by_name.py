"""Logs by name: one that is not among the results is answered with the nearest that are."""

from __future__ import annotations

from collections.abc import Sequence
from difflib import get_close_matches
from pathlib import PurePath

from cdtool.errors import UsageError


class UnknownLogError(UsageError, KeyError):
    """No log of that name is among the results, or `several` are."""

    several = False


def number_of(name: str, logs: Sequence[str]) -> int:
    """Return the number of the log of that name, or of the only one whose path ends in it.

    Raises UnknownLogError with the nearest names, or with those that the name fits.

    Examples
    --------
    >>> number_of("03.csv", ["stiff/02.csv", "stiff/03.csv"])
    1
    """
    wanted = PurePath(name).parts
    exact = [place for place, log in enumerate(logs) if log == name]
    found = exact or [
        place for place, log in enumerate(logs) if wanted and PurePath(log).parts[-len(wanted) :] == wanted
    ]
    if len(found) == 1:
        return found[0]
    if found:
        same = ", ".join(f"{'/'.join(PurePath(logs[place]).parts[-len(wanted) - 1 :])} [{place}]" for place in found)
        fault = UnknownLogError(f"{len(found)} logs are named '{name}'", f"give more of the path or the number: {same}")
        fault.several = True
        raise fault
    ends = [PurePath(log).name for log in logs]
    close = get_close_matches(PurePath(name).name, dict.fromkeys(ends), n=2, cutoff=0.5)
    hint = f"did you mean {' or '.join(close)}?" if close else f"known: {', '.join(dict.fromkeys(ends))}"
    raise UnknownLogError(f"no log '{name}' in these results", hint)
