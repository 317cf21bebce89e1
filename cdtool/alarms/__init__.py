"""From the signal of a detector to its alarms: threshold, activation, judgement."""
