"""The file around the messages: records, chunks, checksums, and what is left where a file is damaged."""
