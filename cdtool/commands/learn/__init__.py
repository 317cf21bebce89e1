"""`cdtool learn-signature`."""
