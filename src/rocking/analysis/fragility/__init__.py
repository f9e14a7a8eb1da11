"""Fragility: the probability that a block overturns, or passes a rotation, against the intensity of the motion."""
