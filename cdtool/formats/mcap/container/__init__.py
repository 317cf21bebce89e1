"""The container of the messages: records, chunks, checksums, and recovery of damaged files."""
