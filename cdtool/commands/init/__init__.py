"""`cdtool init`: draft a machine file from a log; one guess per module."""
