"""What is not about collisions: errors, files, findings, tables of TOML, compiled kernels."""
