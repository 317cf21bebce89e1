"""`cdtool explain`."""
