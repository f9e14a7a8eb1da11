"""Nonlinear dynamics with impacts: bodies between stops, and long-term behaviour under periodic motion.

Positions (m) are relative to the table or the support, whose acceleration (m/s^2) is the motion.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
