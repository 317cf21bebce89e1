"""The project as a whole: pages, layers, pipeline files, version bounds, markers of the tests."""
