"""Messages of topics: schemas, decoding, fields and their columns, whatever container they were logged in."""
