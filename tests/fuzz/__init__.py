"""Hostile files and options to every command."""
