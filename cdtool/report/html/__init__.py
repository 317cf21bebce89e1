"""The report as one HTML file: tables, plots that zoom, no network."""
