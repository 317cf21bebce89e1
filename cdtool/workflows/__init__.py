"""What a command does, as plain functions that print nothing: a folder or a module for each, and what they share."""
