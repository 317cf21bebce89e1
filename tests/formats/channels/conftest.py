"""The fixtures of the format tests, for logs and machine files."""

from __future__ import annotations

from tests.formats.conftest import log, machine
from tests.formats.mcap_files import by_hand

__all__ = ["by_hand", "log", "machine"]
