"""`cdtool robot`."""
