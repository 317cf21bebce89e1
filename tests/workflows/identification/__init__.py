"""Tests of cdtool/workflows/identification."""
