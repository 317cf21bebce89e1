"""Results in a file or folder, read back and checked field by field."""
