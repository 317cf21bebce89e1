"""Every contact as a row of a CSV file."""

from __future__ import annotations

from dataclasses import fields

from cdtool.evaluation.results import ContactResult, Results
from cdtool.report.csv_text import csv_text


def contacts_csv(results: Results) -> str:
    """One row a contact and detector, in the order and under the names of results.json; empty = no figure."""
    names = [item.name for item in fields(ContactResult)]
    return csv_text(names, ([getattr(contact, name) for name in names] for contact in results.contacts))
