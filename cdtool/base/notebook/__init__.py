"""How results show themselves in Python and in a notebook: short values, tables, parameters by name."""
