"""`cdtool learn`."""
