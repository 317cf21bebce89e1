"""Damaged MCAP files from a seed, each with its expected messages and findings."""
