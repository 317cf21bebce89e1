"""Schemas in a file, as text or descriptor -> the fields of a message; one module per schema encoding."""
