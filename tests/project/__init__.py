"""The project as a whole: its pages, its layers, its pipeline files, its bounds of versions, its tests' markers."""
