"""The work of each command as plain functions that print nothing: a folder or module per command, and shared steps."""
