"""`cdtool score`."""
