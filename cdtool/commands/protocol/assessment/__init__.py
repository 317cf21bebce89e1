"""A test protocol: the plan of a force measurement, what was measured, and the verdict with its reasons."""
