"""Schemas: the text or descriptor that a file carries -> which fields a message has, one file a schema encoding."""
