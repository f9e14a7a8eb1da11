"""A word before the kernels are compiled: that takes a while, and happens once."""

from __future__ import annotations

import functools

from rocking.progress import note

#: Processor time that the kernels of a simulation take to compile, s.
_SECONDS = 10


@functools.cache
def announce() -> None:
    """From now on, note on stderr when kernels are not found in the cache and must be compiled.

    The compiler itself says when it starts: what is cached, for which sources and processor, is known to it alone.
    """
    from numba.core import event

    class FirstStart(event.Listener):  # type: ignore[misc]
        """Speaks when the first kernel is compiled."""

        told = False

        def on_start(self, event: object) -> None:
            if not self.told:
                note(f"compiling once for this machine, about {_SECONDS} s; later runs start at once")
            self.told = True

        def on_end(self, event: object) -> None:
            pass

    event.register("numba:compile", FirstStart())
