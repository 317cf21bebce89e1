"""The true contacts of a log, and what detectors made of them: one answer for every command."""
