"""Errors that the readers of a file's parts raise for damaged bytes."""

from __future__ import annotations


class DamageError(Exception):
    """Bytes that cannot be what they declare; the text is the reason that is displayed to the user."""


class RefusedError(DamageError):
    """Bytes that are not decompressed because of their declared size: the file may be a decompression bomb."""
