"""Recognise text files of other formats by their first bytes: exports of TwinCAT Scope, LabVIEW's measurement files."""

from __future__ import annotations

from collections.abc import Sequence

_MARK = b"\xef\xbb\xbf"
# In any encoding: a name is within the first bytes once NUL bytes and byte order marks are removed.
_FIRST_BYTES = 96
LABVIEW = "LabVIEW Measurement"
# TwinCAT Scope: the key of the first line, and the keys that identify its exports.
NAME = "Name"
SCOPE_TITLE = "TwinCAT Scope"
SCOPE_STARTS = ("Starttime of export", "StartRecord")
SCOPE_KEYS = ("SymbolName", "SampleTime[ms]", "Data-Type", "SymbolBased", "IndexGroup", "NetID", "NetId", "Port")
_SCOPE_SEPARATORS = "\t;,|: "
_FIRST_LINES = 20
# An export with fewer keys of channels is another table with a column Name.
_FEWEST_KEYS = 2


def is_measurement(head: bytes) -> bool:
    """Return whether the first bytes of a file are those of LabVIEW's measurement files."""
    return _begin(head).startswith(LABVIEW.encode())


def is_scope_export(head: bytes) -> bool:
    """Return whether the first bytes of a file are those of an export of TwinCAT Scope."""
    if not _begin(head).startswith((NAME.encode(), SCOPE_TITLE.encode())):
        return False
    lines = head.replace(b"\0", b"").removeprefix(_MARK).lstrip(b"\xff\xfe").decode("utf-8", errors="replace")
    first = lines.splitlines()[:_FIRST_LINES]
    separator = scope_separator(first)
    if separator is None:
        return False
    keys = {line.partition(separator)[0] if line[:1] != '"' else line.split('"')[1] for line in first}
    repeated = any(line.split(separator).count(NAME) > 1 for line in first if line.startswith(NAME))
    return repeated or bool(keys & {*SCOPE_STARTS}) or len(keys & {*SCOPE_KEYS}) >= _FEWEST_KEYS


def scope_separator(lines: Sequence[str]) -> str | None:
    """Return the separator, which follows the key Name in one of the first lines; None if there is no such line."""
    for line in lines:
        text = line.lstrip("\ufeff")
        if text.startswith(NAME) and text[len(NAME) : len(NAME) + 1] in (*_SCOPE_SEPARATORS,):
            return text[len(NAME)]
    return None


def _begin(head: bytes) -> bytes:
    return head[:_FIRST_BYTES].replace(b"\0", b"").removeprefix(_MARK).lstrip(b"\xff\xfe")
