"""Simulated machines: physical models that write measured channels together with their true contacts."""
