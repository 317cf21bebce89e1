"""Simulate a gate and an arm with known ground truth."""
