"""The transmission between drive and contact: its transfer function and its simulation."""
