"""The commands as functions: their results as values, frames and figures."""
