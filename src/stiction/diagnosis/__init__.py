"""Whose fault is it, and how much? From a record to a verdict."""
