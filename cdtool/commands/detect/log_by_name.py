"""Logs by name: one that is not among the results is answered with the nearest that are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from difflib import get_close_matches
from pathlib import PurePath

from cdtool.base.errors import UsageError


class UnknownLogError(UsageError, KeyError):
    """No log of that name is among the results, or `several` are."""

    several = False


def number_of(name: str, logs: Sequence[str], left_out: Mapping[str, str] | None = None) -> int:
    """Return the number of the log of that name, or of the only one whose path ends in it.

    `left_out` are logs without a result, with the reason. Raises UnknownLogError with that reason, with the nearest
    names, or with those that the name fits.

    Examples
    --------
    >>> number_of("03.csv", ["stiff/02.csv", "stiff/03.csv"])
    1
    """
    wanted = PurePath(name).parts
    exact = [place for place, log in enumerate(logs) if log == name]
    found = exact or [place for place, log in enumerate(logs) if _ends_in(log, wanted)]
    if len(found) == 1:
        return found[0]
    if found:
        same = ", ".join(f"{'/'.join(PurePath(logs[place]).parts[-len(wanted) - 1 :])} [{place}]" for place in found)
        fault = UnknownLogError(f"{len(found)} logs are named '{name}'", f"give more of the path or the number: {same}")
        fault.several = True
        raise fault
    reason = next((reason for log, reason in (left_out or {}).items() if _ends_in(log, wanted)), None)
    raise UnknownLogError(
        f"no log '{name}' in these results", f"it was left out: {reason}" if reason else _near(name, logs)
    )


def _ends_in(log: str, wanted: tuple[str, ...]) -> bool:
    return bool(wanted) and PurePath(log).parts[-len(wanted) :] == wanted


def _near(name: str, logs: Sequence[str]) -> str:
    if not logs:
        return "they are empty"
    ends = [PurePath(log).name for log in logs]
    close = get_close_matches(PurePath(name).name, dict.fromkeys(ends), n=2, cutoff=0.5)
    return f"did you mean {' or '.join(close)}?" if close else f"known: {', '.join(dict.fromkeys(ends))}"
