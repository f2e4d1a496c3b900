"""Tame it."""
