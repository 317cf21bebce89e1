"""`cdtool coverage`."""
