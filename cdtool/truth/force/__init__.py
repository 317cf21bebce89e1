"""The force of a contact over time, and its limits."""
