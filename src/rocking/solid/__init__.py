"""Rigid bodies in space, from meshes or mass properties, and their blocks in vertical planes."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
