"""`cdtool transmissions`."""
