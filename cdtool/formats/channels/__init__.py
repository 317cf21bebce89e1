"""Columns -> channels: select the format, map columns to channels, check clocks and units, and join parts of a log."""
