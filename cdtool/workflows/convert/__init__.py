"""`cdtool convert`: a log into another container."""
