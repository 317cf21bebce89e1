"""Curves that are kept at detection, so that reports draw without computing again."""
