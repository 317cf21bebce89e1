"""`cdtool list`."""
