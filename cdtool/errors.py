"""Errors that a user can act on.

Conventions: one line that names the file, the row or key and the value, then a hint that names the next step.
"""

from __future__ import annotations

from difflib import get_close_matches
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable


class CdtoolError(Exception):
    """A known fault: `message` says what is wrong and where, `hint` what to do next.

    `channel` is the channel of the log that it is about, for code that can do without one; else empty.
    """

    def __init__(self, message: str, hint: str = "", *, channel: str = "") -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint
        self.channel = channel

    def __str__(self) -> str:
        return f"{self.message} ({self.hint})" if self.hint else self.message


class UsageError(CdtoolError):
    """A command or function was called with arguments that do not fit."""


class ConfigurationError(CdtoolError):
    """A machine file or benchmark file is wrong; the message names the key."""


class RecordingError(CdtoolError):
    """A recording cannot be read, or lacks what is needed."""


class OutputError(CdtoolError):
    """A file or folder cannot be written: what was there before is still there."""


class SignatureError(CdtoolError):
    """A signature cannot be learned, read, or does not belong to what it is applied to."""


class NothingValidError(SignatureError):
    """The runs to learn from hold nothing that the detector could judge: that lies in detector and motion."""


def nearest(name: str, known: Iterable[str]) -> str:
    """Words that help after a wrong name: the nearest known ones first, then all of them."""
    names = sorted(known)
    close = get_close_matches(name, names, n=2, cutoff=0.5)
    listed = ", ".join(names) if names else "none"
    if close:
        return f"did you mean {' or '.join(close)}? known: {listed}"
    return f"known: {listed}"
