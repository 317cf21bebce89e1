"""How a text table is written: separators, marks, head lines and encodings."""
