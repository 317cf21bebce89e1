"""Tests of cdtool/machines/robot_model."""
