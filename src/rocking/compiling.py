"""A note while kernels are compiled: that takes a while, and happens once."""

from __future__ import annotations

import time
from typing import Final

from rocking.kernels import compiled
from rocking.progress import note

#: Processor time, s, that takes to compile what is missing, with nothing there: for the simulation of any motion, alone
#: or in ensembles; for a chattering sequence under a sine; for critical amplitudes under one.
SIMULATIONS: Final = 25
SEQUENCES: Final = 20
AMPLITUDES: Final = 5

#: What takes less than this is not worth a word, s.
_PATIENCE: Final = 1.0


class _Compilations:
    """Speaks as soon as the compiler has been at work for some time; a kernel is compiled with its parts."""

    def __init__(self) -> None:
        self.expected, self.noted = 0, set[int]()
        self.functions, self.since, self.spent = 0, 0.0, 0.0

    def expect(self, seconds: int) -> None:
        if seconds != self.expected:
            self.expected, self.spent = seconds, 0.0

    def start(self) -> None:
        now = time.process_time()
        if self.functions == 0:
            self.since = now
        self.functions += 1
        if self.expected not in {0, *self.noted} and self.spent + now - self.since >= _PATIENCE:
            self.noted.add(self.expected)
            note(f"compiling what this needs, up to {self.expected} s of processor time; later runs find it ready")

    def end(self) -> None:
        self.functions -= 1
        if self.functions == 0:
            self.spent += time.process_time() - self.since


_compilations: Final = _Compilations()


def announce(seconds: int) -> None:
    """From now on, note on stderr when kernels are not found in the cache and must be compiled; once for each work.

    The compiler itself says when it is at work: what is cached, for which sources and processor, is known to it alone.
    """
    _compilations.expect(seconds)


def _watch_compiler() -> None:
    """Hear from numba's compiler when it works; numba is imported no earlier."""
    # As a whole first: where two threads import it, one from a part of it on, each may wait for the other.
    import numba  # noqa: F401
    from numba.core import event

    class Listener(event.Listener):  # type: ignore[misc]
        def on_start(self, event: object) -> None:
            _compilations.start()

        def on_end(self, event: object) -> None:
            _compilations.end()

    event.register("numba:compile", Listener())


compiled.before_compiling.append(_watch_compiler)
