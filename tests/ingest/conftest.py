"""The logs and machine files of the tests of formats."""

from __future__ import annotations

from tests.formats.conftest import log, machine

__all__ = ["log", "machine"]
