"""Tests of cdtool/workflows/injection."""
