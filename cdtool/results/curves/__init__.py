"""Results over a setting or over time: false alarms over the safety factor, contacts undetected over time."""
