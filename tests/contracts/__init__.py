"""What every registered class keeps: detectors, thresholds, machines, formats, writers."""
