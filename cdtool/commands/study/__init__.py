"""`cdtool study`: rank the sensors by when they detect an impact, before a machine is built."""
