"""`cdtool store`."""
