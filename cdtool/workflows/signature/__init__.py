"""`cdtool learn-signature` and `cdtool signature`: thresholds and normal motions, learned from impact-free runs."""
