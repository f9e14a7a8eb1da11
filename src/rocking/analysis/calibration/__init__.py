"""Calibration: the block behind observed outcomes, or behind a measured rotation history."""
