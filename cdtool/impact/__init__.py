"""Impacts: contact laws, restitution, transmissions, and which sensor responds first."""
