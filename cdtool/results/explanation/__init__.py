"""Why an alarm came, why a contact was missed, and what moved first."""
