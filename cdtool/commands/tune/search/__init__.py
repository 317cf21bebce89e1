"""Search gains, threshold and activation at a false-alarm budget, and assess the choice on other recordings."""
