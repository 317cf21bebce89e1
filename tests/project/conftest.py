"""A folder in which the commands and examples of the documentation run."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.project.pages import DOCS, ROOT


@pytest.fixture
def checkout(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Work in a new folder that looks like a checkout."""
    (tmp_path / "docs").mkdir()
    shutil.copytree(ROOT / "sample_logs", tmp_path / "sample_logs")  # commands may write beside a benchmark file
    (tmp_path / "docs" / "examples").symlink_to(DOCS / "examples")
    monkeypatch.chdir(tmp_path)
    return tmp_path
