"""What truly happened, and which alarm belongs to it: onsets, labels, triggers, matching."""
