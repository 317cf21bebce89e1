"""Tests of cdtool/robot_model."""
