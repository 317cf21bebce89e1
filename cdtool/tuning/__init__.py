"""Search a detector's gains, threshold and activation at a false-alarm budget, with figures that chose nothing."""
