"""`cdtool benchmark`."""
