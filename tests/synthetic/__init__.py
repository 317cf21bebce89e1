"""Synthetic machines, motions, logs and results of builds that many tests use. No tests."""
