"""`cdtool coverage`: where a machine notices a contact, over position and stiffness."""
