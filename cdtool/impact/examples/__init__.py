"""Impacts with numbers, for the figures, the pages and the tests: chapter_3.py, chapter_4.py (Table 4.1)."""
