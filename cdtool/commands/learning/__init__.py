"""`cdtool learn-signature` and `cdtool signature`: thresholds and normal motions from impact-free runs."""
