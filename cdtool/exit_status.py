"""The exit status of every command, decided in one place from facts that the command has found.

Conventions: a command collects facts and calls `status_of`; it never chooses a number itself. Where several facts
apply, 2 comes before 1, 1 before 3 and 3 before 4. `STATUSES` is the table of docs/ci.md and of `cdtool --help`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from enum import Enum, IntEnum


class ExitStatus(IntEnum):
    """What a command's exit status tells a pipeline."""

    OK = 0
    VIOLATED = 1
    UNUSABLE = 2
    LOST = 3
    INCONCLUSIVE = 4
    INTERRUPTED = 130
    """128 and the number of the signal that Ctrl-C sends, as a shell counts it; so are the next two."""
    TERMINATED = 143
    HUNG_UP = 129


class Fact(Enum):
    """Something about a command's work that its exit status has to show."""

    LIMIT_VIOLATED = "a limit is violated, or could not be assessed and so is not met"
    FORCE_VIOLATED = "a contact violates its force profile, or is missed where one is set"
    WORSE = "a change for the worse is shown"
    WRONG_USAGE = "wrong usage, or a wrong file"
    NOTHING_USABLE = "nothing usable is left"
    INTERNAL_ERROR = "an error of cdtool itself"
    LOST = "data was lost"
    LEFT_OUT = "something was left out"
    NOTHING_ASSESSABLE = "nothing could be assessed"
    INCONCLUSIVE = "the sample is too small for a conclusion, and one was required"
    INCOMPLETE = "part of what was asked for could not be decided"
    INTERRUPTED = "interrupted"


_STATUS_OF: Mapping[Fact, ExitStatus] = {
    Fact.LIMIT_VIOLATED: ExitStatus.VIOLATED,
    Fact.FORCE_VIOLATED: ExitStatus.VIOLATED,
    Fact.WORSE: ExitStatus.VIOLATED,
    Fact.WRONG_USAGE: ExitStatus.UNUSABLE,
    Fact.NOTHING_USABLE: ExitStatus.UNUSABLE,
    Fact.INTERNAL_ERROR: ExitStatus.UNUSABLE,
    Fact.LOST: ExitStatus.LOST,
    Fact.LEFT_OUT: ExitStatus.LOST,
    Fact.NOTHING_ASSESSABLE: ExitStatus.LOST,
    Fact.INCONCLUSIVE: ExitStatus.INCONCLUSIVE,
    Fact.INCOMPLETE: ExitStatus.INCONCLUSIVE,
    Fact.INTERRUPTED: ExitStatus.INTERRUPTED,
}
# Where several apply; an interrupted command has found out nothing else.
_FIRST_TO_LAST = (
    ExitStatus.INTERRUPTED,
    ExitStatus.UNUSABLE,
    ExitStatus.VIOLATED,
    ExitStatus.LOST,
    ExitStatus.INCONCLUSIVE,
)

STATUSES: Mapping[ExitStatus, str] = {
    ExitStatus.OK: "all good: done, every limit and force profile met; without --require-power also: inconclusive",
    ExitStatus.VIOLATED: "a limit or force profile is violated or a limit not assessable; a change for the worse",
    ExitStatus.UNUSABLE: "wrong usage, a wrong file, or nothing usable",
    ExitStatus.LOST: "done, but something was lost or left out, or nothing could be assessed",
    ExitStatus.INCONCLUSIVE: "inconclusive or incomplete: the recordings do not suffice for what was asked",
    ExitStatus.INTERRUPTED: "interrupted with Ctrl-C: a file that was being written is left as it was",
    ExitStatus.TERMINATED: "terminated by SIGTERM, in the same way",
    ExitStatus.HUNG_UP: "the terminal was closed (SIGHUP), in the same way",
}
"""What each status means, in one line."""

ORDER = "Where several apply: 2 before 1 before 3 before 4."

_ALWAYS = frozenset({ExitStatus.OK, ExitStatus.UNUSABLE})
_CAN_LOSE = _ALWAYS | {ExitStatus.LOST}
_JUDGES = _CAN_LOSE | {ExitStatus.VIOLATED, ExitStatus.INCONCLUSIVE}
STATUSES_OF: Mapping[str, frozenset[ExitStatus]] = {
    "info": _CAN_LOSE,
    "init": _CAN_LOSE,
    "learn-signature": _CAN_LOSE,
    "detect": _CAN_LOSE,
    "explain": _CAN_LOSE,
    "benchmark": _JUDGES,
    "report": _JUDGES,
    "score": _JUDGES,
    "compare": _ALWAYS | {ExitStatus.VIOLATED, ExitStatus.INCONCLUSIVE},
    "plan": _ALWAYS,
    "convert": _CAN_LOSE,
    "recover": _CAN_LOSE,
    "signature show": _ALWAYS,
    "signature check": _CAN_LOSE,
    "signature update": _CAN_LOSE,
    "simulate gate": _ALWAYS,
    "simulate arm": _ALWAYS,
    "simulate season": _ALWAYS,
    "study sensors": _ALWAYS,
    "study figures": _ALWAYS,
    "list": _CAN_LOSE,
}
"""The statuses that each command can end with, apart from an interruption; its --help shows them."""


def status_of(facts: Iterable[Fact]) -> ExitStatus:
    """Return the exit status of a command that found these facts; 0 without any.

    >>> status_of([Fact.LEFT_OUT, Fact.LIMIT_VIOLATED])
    <ExitStatus.VIOLATED: 1>
    """
    found = {_STATUS_OF[fact] for fact in facts}
    return next((status for status in _FIRST_TO_LAST if status in found), ExitStatus.OK)


def statuses_words(command: str) -> str:
    """Return the line of a command's --help that names the statuses it can end with."""
    numbers = ", ".join(str(int(status)) for status in sorted(STATUSES_OF[command]))
    return f"Exit status: {numbers}; `cdtool --help` explains them."
