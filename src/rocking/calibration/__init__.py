"""Calibration of a block from observed outcomes or from a measured rotation history."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
