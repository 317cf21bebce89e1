"""`cdtool detect`."""
