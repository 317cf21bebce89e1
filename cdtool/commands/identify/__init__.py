"""Model parameters of a machine from impact-free logs: what was identified, and the machine file with it."""
