"""What was measured: a recording, its clock, its units, its motions and its operations."""
