"""`cdtool benchmark`: its file, what it learns, one log's scores and the results of all."""
