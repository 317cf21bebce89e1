"""`cdtool labels`."""
