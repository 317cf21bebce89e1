"""What every room uses and no other room explains: errors, files, findings, tables."""
