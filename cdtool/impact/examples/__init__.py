"""The drive of Table 4.1 of the thesis with numbers, for the pages and the tests."""
