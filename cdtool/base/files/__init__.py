"""Files of the machine: written whole or not at all, locked, and told apart by their content."""
