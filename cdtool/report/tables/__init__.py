"""The tables of a report as plain values, by subject."""
