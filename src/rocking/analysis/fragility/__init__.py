"""Fragility: the probability that a block overturns, or passes a rotation, against the intensity of the motion."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
