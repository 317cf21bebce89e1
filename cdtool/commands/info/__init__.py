"""`cdtool info`."""
