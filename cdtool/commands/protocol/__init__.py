"""`cdtool protocol`, and the protocol of `cdtool benchmark`: read its file, draft and check it, measure its points."""
