"""What is wrong with a file, as the readers of its parts raise it."""

from __future__ import annotations


class DamageError(Exception):
    """Bytes that cannot be what they claim to be; the text is the reason a user sees."""


class RefusedError(DamageError):
    """Bytes that would grow as only a bomb does: they may be whole, but are not decompressed."""
