"""`cdtool notebook`."""
