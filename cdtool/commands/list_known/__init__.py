"""`cdtool list-known`."""
