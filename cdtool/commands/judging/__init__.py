"""The true contacts of a log and the results of detectors on them, identical for every command."""
