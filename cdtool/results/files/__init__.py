"""`cdtool files`."""
