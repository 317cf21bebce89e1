"""Figures that can be defended: intervals, tests and sample sizes. Pure functions on arrays."""
