"""One log through one detector, as `cdtool detect` and `cdtool explain` need it."""
