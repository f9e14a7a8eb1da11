"""Nonlinear dynamics of impact: bodies that are no blocks, and what all bodies of the engine have in common."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
