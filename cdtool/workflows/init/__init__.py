"""`cdtool init`: a look at a log becomes a draft of a machine file; one guess in each module."""
