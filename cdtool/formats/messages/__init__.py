"""Messages of topics: schemas, decoding, fields and their columns, independent of the container format."""
