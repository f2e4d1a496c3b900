"""Which column is which signal of which loop."""
