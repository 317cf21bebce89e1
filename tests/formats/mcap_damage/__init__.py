"""Damaged MCAP files, each with the truth that a careful person would read; seeded."""
