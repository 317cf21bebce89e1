"""From alarms to figures that people can trust: onset, matching, statistics, results."""
