"""Text exports of measuring programs."""
