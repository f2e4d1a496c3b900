"""From what was found to a verdict."""
