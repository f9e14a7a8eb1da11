"""Rocking, chattering, rest and overturning of free-standing rigid blocks under ground motion.

Public names are listed in the stub beside this file, and imported when they are first used, so that ``import rocking``
and the command line start at once.
"""

import lazy_loader

from rocking.core.constants import VERSION

__version__ = VERSION

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
