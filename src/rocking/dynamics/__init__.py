"""Nonlinear dynamics of impact: further bodies of the same engine, and what becomes of any body under periodic motion.

Positions are relative to the table or the support, m; the motion is its acceleration, m/s^2.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
