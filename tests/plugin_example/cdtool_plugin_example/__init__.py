"""A collision detector and a threshold for cdtool."""
