"""Tests of cdtool/machines/axis_model."""
