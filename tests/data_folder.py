"""Where the real recordings are, and a mark that skips a test, by name, where one of them is absent."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

_GIVEN = Path(os.environ.get("CDTOOL_DATA", Path(__file__).resolve().parents[2] / "shared" / "data"))
DATA: Path | None = _GIVEN if _GIVEN.is_dir() else None


def needs_data(name: str) -> pytest.MarkDecorator:
    """Skip a test where the file or folder `name` of the recordings is absent."""
    present = DATA is not None and (DATA / name).exists()
    return pytest.mark.skipif(not present, reason=f"no recording {name} (set CDTOOL_DATA)")


def data(name: str) -> Path:
    """The path of a recording; only in tests marked with `needs_data`."""
    assert DATA is not None
    return DATA / name
