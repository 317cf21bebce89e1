"""`cdtool study`: which sensor sees an impact first, before a machine is built."""
