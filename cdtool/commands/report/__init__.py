"""`cdtool report`."""
