"""Results as a notebook shows them: DataFrames, figures, one line as text, a small table as HTML.

The workflows return plain rows, which every report shows; what is here joins them with pandas and the figures, which
are imported at their first use.
"""
