"""The report as Markdown, fit for a pull request."""
