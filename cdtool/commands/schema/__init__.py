"""`cdtool schema`."""
