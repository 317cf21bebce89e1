"""Tests of cdtool/identification."""
