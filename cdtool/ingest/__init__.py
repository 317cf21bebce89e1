"""Columns -> channels: which format, which columns, on which clock, in which unit, and the series that they become."""
