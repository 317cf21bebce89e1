"""Parameters of a contact from its force at the load cell."""
