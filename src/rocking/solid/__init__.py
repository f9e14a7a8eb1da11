"""Rigid bodies in space, as a mesh gives them, and the blocks that they are in the plane of each azimuth."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
