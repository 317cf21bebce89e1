"""`cdtool benchmark`: its file, learning, scoring one log, and the results of all logs."""
