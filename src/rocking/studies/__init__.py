"""Studies too long for one sitting: what is simulated, where it is kept, who runs it."""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
