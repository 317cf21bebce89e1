"""Two results of one bench: what a new build changed."""
