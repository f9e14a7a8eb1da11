"""Calibration of blocks from observed outcomes or a measured rotation history."""

import lazy_loader as lazy

__getattr__, __dir__, __all__ = lazy.attach_stub(__name__, __file__)
