"""`cdtool tune`: search a detector's gains, threshold and activation at a false-alarm budget."""
