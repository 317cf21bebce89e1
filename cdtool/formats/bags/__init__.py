"""Bags and other logs of topics."""
