"""Every contact as a row of a CSV file that a spreadsheet may open."""

from __future__ import annotations

import csv
from dataclasses import fields
from io import StringIO

from cdtool.evaluation.results import ContactResult, Results

# A spreadsheet runs a cell that begins with one of these (the last four are their full-width forms).
_RUN_BY_SPREADSHEETS = ("=", "+", "-", "@", "\t", "\r", "＝", "＋", "－", "＠")


def contacts_csv(results: Results) -> str:
    """One row a contact and detector, in the order and under the names of results.json; empty = no figure."""
    names = [item.name for item in fields(ContactResult)]
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(names)
    writer.writerows([_cell(getattr(contact, name)) for name in names] for contact in results.contacts)
    return text.getvalue()


def _cell(value: object) -> object:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str) and value.startswith(_RUN_BY_SPREADSHEETS):
        return f"'{value}"
    return value
