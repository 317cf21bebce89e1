"""Errors with a next step for the user.

Conventions: one line with the file, the row or key and the value, then a hint with the next step.
"""

from __future__ import annotations

from contextlib import contextmanager
from difflib import get_close_matches
from itertools import takewhile
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence


class CdtoolError(Exception):
    """A known error: `message` states what is wrong and where, `hint` what to do next.

    `channel` is the channel of the log that it is about, for code that can do without one; else empty.
    """

    def __init__(self, message: str, hint: str = "", *, channel: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint
        self.channel = channel

    def __str__(self) -> str:
        return f"{self.message} ({self.hint})" if self.hint else self.message

    def _render_traceback_(self) -> list[str]:
        """Return what Jupyter shows: the line of the caller and the error, without the frames inside cdtool.

        `%debug` still stops where the error was raised.
        """
        import traceback

        package = str(Path(__file__).parents[1])
        calls = traceback.extract_tb(self.__traceback__)
        callers = list(takewhile(lambda call: not call.filename.startswith(package), calls))
        place = [f"line {callers[-1].lineno}: {callers[-1].line}"] if callers and callers[-1].line else []
        hint = [f"next step: {self.hint}"] if self.hint else []
        return [*place, f"{type(self).__name__}: {self.message}", *hint]


class UsageError(CdtoolError):
    """A command or function was called with invalid arguments."""


class FieldsError(UsageError):
    """Values of a model are wrong or do not fit together: `problem` is that of the first of its `fields`.

    A field may be that of an item of a list, as `points[2].name`.
    """

    def __init__(self, fields: tuple[str, ...], problem: str, hint: str = "") -> None:
        super().__init__(f"{fields[0]} {problem}", hint)
        self.args = (fields, problem, hint)  # for another process
        self.fields = fields
        self.problem = problem


class ConfigurationError(CdtoolError):
    """A machine file or benchmark file is wrong; the message names `file` and `key`, which are empty if not known."""

    key, file = "", ""


class MistakesError(ConfigurationError):
    """Several mistakes of a file: `mistakes`, in its order."""

    mistakes: tuple[ConfigurationError, ...] = ()

    @classmethod
    def of(cls, mistakes: Sequence[ConfigurationError]) -> ConfigurationError:
        """Return the mistakes as one error; a single one is itself."""
        if len(mistakes) == 1:
            return mistakes[0]
        channel = next((item.channel for item in mistakes if item.channel), "")
        found = cls("\n".join(map(str, mistakes)), channel=channel)
        found.mistakes = tuple(mistakes)
        return found


class RecordingError(CdtoolError):
    """A recording cannot be read, or something it needs is missing."""


class OutputError(CdtoolError):
    """A file or folder cannot be written; its previous content is unchanged."""


class SignatureError(CdtoolError):
    """A signature cannot be learned or read, or does not belong to the machine, detector or log."""


class WorkerError(CdtoolError):
    """A process that works for this one ended before its result."""


class NothingValidError(SignatureError):
    """The detector cannot assess any sample of the runs to learn from, because of detector and motion."""


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Put the file at the beginning of an error that is raised inside, unless it begins with it.

    What raises an error knows the row or key and the value; only what opens a file needs to know its path.
    """
    try:
        yield
    except CdtoolError as fault:
        if not fault.message.startswith((f"{path}: ", f"{path}#", f"{path}/")):
            fault.message = f"{path}: {fault.message}"
        raise


def installing(extra: str) -> str:
    """Return how an extra is installed: in the checkout, as long as no index has the package."""
    return f"pip install '.[{extra}]'"


def nearest(name: str, known: Iterable[str]) -> str:
    """Return a hint for a wrong name: the nearest known names first, then all of them."""
    names = sorted(known)
    close = get_close_matches(name, names, n=2, cutoff=0.5)
    listed = ", ".join(names) if names else "none"
    if close:
        return f"did you mean {' or '.join(close)}? known: {listed}"
    return f"known: {listed}"


def is_lasting(fault: CdtoolError) -> bool:
    """Return whether the same files give the same error again: it is not one of the system.

    A network, a full disk, missing permissions, too little memory or a package that is not installed may be in order
    the next time.
    """
    seen: set[int] = set()
    cause: BaseException | None = fault
    while cause is not None and id(cause) not in seen:
        if isinstance(cause, OSError | ImportError | MemoryError):
            return False
        seen.add(id(cause))
        cause = cause.__cause__ or cause.__context__
    return True
