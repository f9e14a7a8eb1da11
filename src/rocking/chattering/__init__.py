"""Chattering: dimensionless theory under a sine (asymptotic, semi-analytical, series, exact), and simulations.

The parameters are the amplitude ``a`` of the ground acceleration, divided by g alpha, the forcing frequency ``omega``,
divided by p of the block, and the coefficient of restitution ``eta``. Times are p t, speeds theta'/(p alpha).
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
