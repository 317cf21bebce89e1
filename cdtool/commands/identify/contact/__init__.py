"""`cdtool contact`."""
