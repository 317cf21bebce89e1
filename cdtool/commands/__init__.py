"""The commands: a folder for each with its whole slice; what several share is below them."""
