"""Calibration of the diagnosis: simulated loops, feature rows, training, ablation. Not part of the wheel."""
