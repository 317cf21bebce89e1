"""The map of `cdtool inject`: where a machine notices a contact, over position and stiffness."""
