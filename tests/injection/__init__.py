"""Tests of cdtool/injection."""
