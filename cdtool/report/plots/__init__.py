"""Figures. matplotlib is loaded by the first one."""
