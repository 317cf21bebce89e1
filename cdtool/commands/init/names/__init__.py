"""`cdtool names`."""
