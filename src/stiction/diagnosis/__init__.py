"""Whose fault is it, and how much? From a record to a verdict."""

from stiction.diagnosis.identification import identify

__all__ = ["identify"]
