"""`cdtool curves`."""
