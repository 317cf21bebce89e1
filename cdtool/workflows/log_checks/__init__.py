"""What is wrong with a log itself: the same checks in every command."""
