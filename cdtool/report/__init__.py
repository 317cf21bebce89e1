"""Figures, tables and report folders: they show results and compute none. matplotlib is loaded by the first figure."""
