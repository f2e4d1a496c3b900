"""Exact limit cycles in continuous time."""
