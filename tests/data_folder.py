"""Location of the real recordings, and the marker of tests that need one that is not part of the project."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

_GIVEN = Path(os.environ.get("CDTOOL_DATA", Path(__file__).resolve().parents[2] / "shared" / "data"))
DATA: Path | None = _GIVEN if _GIVEN.is_dir() else None

# A real arm, whose recordings every checkout has.
UR10E_LOGS = Path(__file__).resolve().parents[1] / "sample_logs" / "ur10e"


def is_present(name: str) -> bool:
    """Whether the file or folder `name` of the recordings exists."""
    return DATA is not None and (DATA / name).exists()


def needs_data(*names: str) -> pytest.MarkDecorator:
    """Mark a test to be skipped, by name, if one of these files or folders of the recordings is missing."""
    return pytest.mark.real_data(*names)


def data(name: str) -> Path:
    """Return the path of a recording; only for tests marked with `needs_data`."""
    assert DATA is not None
    return DATA / name
