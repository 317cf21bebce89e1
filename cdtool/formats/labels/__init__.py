"""Tables that a person or another program writes beside the logs: contacts and triggers."""
