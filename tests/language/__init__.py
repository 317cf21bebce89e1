"""The language of the project: a checker of its texts, and the phrases that it refuses."""
