"""`cdtool detecting`."""
