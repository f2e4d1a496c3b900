"""Cells to numbers: decimal marks, units, bad values, span."""
