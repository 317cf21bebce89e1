"""Make docs/results.schema.json: python docs/make_schema.py"""

from __future__ import annotations

import json
from pathlib import Path

from cdtool.results.files.results_file import results_schema

FILE = Path(__file__).with_name("results.schema.json")


def schema_text() -> str:
    """The file's content."""
    return json.dumps(results_schema(), indent=1) + "\n"


if __name__ == "__main__":
    FILE.write_text(schema_text(), encoding="utf-8")
