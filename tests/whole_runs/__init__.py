"""Whole runs of commands and of the Python API: long logs, plug-ins, several joints, real recordings."""
