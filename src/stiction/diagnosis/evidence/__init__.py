"""Evidence over time: many windows of one valve, one probability, and what changed when."""
