"""The command line: translates arguments, prints. The only place that knows typer and rich."""
