"""Tests of cdtool/commands/identify."""
