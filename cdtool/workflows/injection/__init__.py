"""Contacts put into impact-free logs: the section [inject] of a benchmark file, and the recordings made by it."""
