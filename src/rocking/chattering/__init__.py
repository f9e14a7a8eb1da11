"""Chattering: the dimensionless theory under a sine (asymptotic, semi-analytical, series, exact), and what lies beyond.

Parameters throughout: amplitude ``a`` of the ground acceleration over g alpha, ``omega`` = forcing frequency over the
block's p, ``eta`` = coefficient of restitution; times are p t, speeds theta'/(p alpha).
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
