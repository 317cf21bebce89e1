"""The exit status of every command, derived in one place from the facts that the command reports.

Conventions: a command collects facts and calls `status_of`; it never chooses a number itself. If several facts apply, 2
comes before 1, 1 before 3 and 3 before 4. `STATUSES` is the table of docs/ci.md and of `cdtool --help`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from enum import Enum, IntEnum


class ExitStatus(IntEnum):
    """The meaning of a command's exit status for a pipeline."""

    OK = 0
    VIOLATED = 1
    UNUSABLE = 2
    LOST = 3
    INCONCLUSIVE = 4
    INTERRUPTED = 130
    """128 plus the number of the signal that Ctrl-C sends, as in a shell; the next two likewise."""
    TERMINATED = 143
    HUNG_UP = 129


class Fact(Enum):
    """A fact about a command's work that determines its exit status."""

    LIMIT_VIOLATED = "a limit is violated, or is not assessable and therefore not met"
    FORCE_VIOLATED = "a contact violates its force profile, or is missed where one is set"
    WORSE = "a change for the worse is shown"
    LATER = "a build is later on the same contacts, and --fail-if-later was given"
    WRONG_USAGE = "wrong usage, or a wrong file"
    NOTHING_USABLE = "nothing usable is left"
    INTERNAL_ERROR = "an error of cdtool itself"
    LOST = "data was lost"
    LEFT_OUT = "something was left out"
    NOTHING_ASSESSABLE = "nothing could be assessed"
    INCONCLUSIVE = "the sample is too small for a conclusion, and one was required"
    INCOMPLETE = "part of the request could not be decided"
    INTERRUPTED = "interrupted"


_STATUS_OF: Mapping[Fact, ExitStatus] = {
    Fact.LIMIT_VIOLATED: ExitStatus.VIOLATED,
    Fact.FORCE_VIOLATED: ExitStatus.VIOLATED,
    Fact.WORSE: ExitStatus.VIOLATED,
    Fact.LATER: ExitStatus.VIOLATED,
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
# Priority if several apply; an interrupted command has no other result.
_FIRST_TO_LAST = (
    ExitStatus.INTERRUPTED,
    ExitStatus.UNUSABLE,
    ExitStatus.VIOLATED,
    ExitStatus.LOST,
    ExitStatus.INCONCLUSIVE,
)

STATUSES: Mapping[ExitStatus, str] = {
    ExitStatus.OK: "done; every limit and force profile met; compare: or inconclusive",
    ExitStatus.VIOLATED: "a limit violated or not assessable, a force profile violated, a build worse",
    ExitStatus.UNUSABLE: "wrong usage, a wrong file, or nothing usable",
    ExitStatus.LOST: "done, but something was lost or left out, or nothing could be assessed",
    ExitStatus.INCONCLUSIVE: "inconclusive: too few recordings, or entries of a protocol are missing",
    ExitStatus.INTERRUPTED: "interrupted with Ctrl-C",
    ExitStatus.TERMINATED: "terminated by SIGTERM",
    ExitStatus.HUNG_UP: "terminal closed",
}
"""The meaning of each status, in one line."""

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
    "tune": _CAN_LOSE,
    "convert": _CAN_LOSE,
    "identify": _CAN_LOSE,
    "inject": _CAN_LOSE,
    "signature show": _ALWAYS,
    "signature check": _CAN_LOSE,
    "signature update": _CAN_LOSE,
    "protocol init": _ALWAYS,
    "protocol write": _ALWAYS | {ExitStatus.VIOLATED, ExitStatus.INCONCLUSIVE},
    "protocol check": _ALWAYS | {ExitStatus.INCONCLUSIVE},
    "simulate": _ALWAYS,
    "study sensors": _ALWAYS,
    "list": _CAN_LOSE,
    "schema": _ALWAYS,
}
"""The statuses with which each command can exit, apart from an interruption; shown in its --help."""


def status_of(facts: Iterable[Fact]) -> ExitStatus:
    """Return the exit status of a command that found these facts; 0 without any.

    >>> status_of([Fact.LEFT_OUT, Fact.LIMIT_VIOLATED])
    <ExitStatus.VIOLATED: 1>
    """
    found = {_STATUS_OF[fact] for fact in facts}
    return next((status for status in _FIRST_TO_LAST if status in found), ExitStatus.OK)


def statuses_words(command: str) -> str:
    """Return the line of a command's --help that lists its statuses."""
    numbers = ", ".join(str(int(status)) for status in sorted(STATUSES_OF[command]))
    return f"Exit status: {numbers}; cdtool --help explains them."


def help_epilog() -> str:
    """Return the end of `cdtool --help`: a line for each status of a finished command, and one for the others."""
    texts = [(status, f"{int(status)} {meaning}") for status, meaning in STATUSES.items()]
    done = [text for status, text in texts if status <= ExitStatus.INCONCLUSIVE]
    ended = ", ".join(text for status, text in texts if status > ExitStatus.INCONCLUSIVE)
    # click does not wrap the paragraph after this mark.
    return "\n".join(["\b", "Exit status; if several apply, 2 before 1 before 3 before 4:", *done, ended])
