"""Stiction and process together, from OP and PV."""
