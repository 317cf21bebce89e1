"""What the names of columns say: quantity, unit, joint."""
