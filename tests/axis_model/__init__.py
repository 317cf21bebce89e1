"""Tests of cdtool/axis_model."""
