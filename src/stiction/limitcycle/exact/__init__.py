"""Limit cycles solved exactly."""
