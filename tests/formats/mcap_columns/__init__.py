"""The columns of MCAP's messages, by the messages' encoding."""
