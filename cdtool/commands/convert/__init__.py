"""`cdtool convert`: write a log in another file format."""
