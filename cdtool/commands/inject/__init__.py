"""Contacts put into impact-free recordings: the difference of two simulations, added to every channel of the log."""
