"""The fixtures of the format tests, for logs and machine files."""

from __future__ import annotations

from tests.formats.conftest import log, machine

__all__ = ["log", "machine"]
