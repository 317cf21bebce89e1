"""Search a detector's gains, threshold and activation at a false-alarm budget, with results that chose nothing."""
