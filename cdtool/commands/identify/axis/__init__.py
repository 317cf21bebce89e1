"""`cdtool axis`."""
