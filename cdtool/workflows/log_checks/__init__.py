"""Checks of a log itself, identical in every command."""
