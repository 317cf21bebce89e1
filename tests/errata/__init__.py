"""The thesis's printed equations that are wrong, and the correct ones, chapter by chapter."""
