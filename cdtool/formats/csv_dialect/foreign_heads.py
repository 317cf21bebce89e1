"""Recognise exports of TwinCAT Scope, and LabVIEW's measurement files (.lvm) that are not one table."""

from __future__ import annotations

from collections.abc import Sequence

from cdtool.base.errors import RecordingError
from cdtool.formats.csv.cells import number

_MARK = b"\xef\xbb\xbf"
MEASUREMENT = b"LabVIEW Measurement"
MEASUREMENT_END = b"***End_of_Header***"
MEASUREMENT_HINT = "write TDMS, or one segment with all channels at one rate and one X column"
_ALIKE = ("Samples", "Date", "Time", "X_Dimension", "X0", "Delta_X")
# TwinCAT Scope: the key of the first line, and the keys that identify its exports.
NAME = "Name"
SCOPE_TITLE = "TwinCAT Scope"
SCOPE_STARTS = ("Starttime of export", "StartRecord")
SCOPE_KEYS = ("SymbolName", "SampleTime[ms]", "Data-Type", "SymbolBased", "IndexGroup", "NetID", "NetId", "Port")
_SCOPE_SEPARATORS = "\t;,|: "


def measurement_head(lines: Sequence[str]) -> tuple[int, str, dict[str, list[str]]]:
    """Return the line of names (from 1) of a measurement file, its separator, and the cells after each key above it.

    Raises RecordingError if the column X_Value does not have the times of all channels.
    """
    keys: dict[str, list[str]] = {}
    for i, line in enumerate(lines, start=1):
        separator = "\t" if "\t" in line else ","
        key, *cells = (cell.strip() for cell in line.split(separator))
        if key == "X_Value":
            return i, separator, keys
        keys[key] = cells
        stated = sorted({*cells} - {""})
        reason = f"its channels differ in {key}: {', '.join(stated)[:60]}" if key in _ALIKE and len(stated) > 1 else ""
        if key == "X_Columns" and stated == ["No"]:
            reason = "it has no column of times (X_Columns No)"
        if key == "X_Dimension" and stated[:1] not in ([], ["Time"]):
            reason = f"its x axis is '{stated[0][:30]}', not Time"
        # Later stamps are absolute: 1e9 s are 32 years.
        if key == "X0" and stated and (number(stated[0].replace(",", "."), ".") or 0.0) > 1e9:
            reason = "its times count from 1904 (Time_Pref Absolute)"
        if reason:
            raise RecordingError(f"LabVIEW: {reason}", MEASUREMENT_HINT)
    raise RecordingError(
        "LabVIEW: its head has no line that begins with X_Value", "was the copy cut off? copy it again"
    )


def is_scope_export(head: bytes) -> bool:
    """Return whether the first bytes of a file are those of an export of TwinCAT Scope, in any encoding."""
    text = head.replace(b"\0", b"").removeprefix(_MARK).lstrip(b"\xff\xfe").decode("utf-8", errors="replace")
    if not text.startswith((NAME, SCOPE_TITLE)):
        return False
    first = text.splitlines()[:20]  # the keys are there
    separator = scope_separator(first)
    if separator is None:
        return False
    keys = {line.partition(separator)[0] if line[:1] != '"' else line.split('"')[1] for line in first}
    repeated = any(line.split(separator).count(NAME) > 1 for line in first if line.startswith(NAME))
    # A table with one key of channels is another one with a column Name.
    return repeated or bool(keys & {*SCOPE_STARTS}) or len(keys & {*SCOPE_KEYS}) >= 2


def scope_separator(lines: Sequence[str]) -> str | None:
    """Return the separator, which follows the key Name in one of the first lines; None if there is no such line."""
    for line in lines:
        text = line.lstrip("\ufeff")
        if text.startswith(NAME) and text[len(NAME) : len(NAME) + 1] in (*_SCOPE_SEPARATORS,):
            return text[len(NAME)]
    return None
