"""What a store holds of a benchmark: learned thresholds, outcomes of logs, finished runs."""
