"""Connections: how many may wait, and for how long, so that those that ask for nothing keep nobody else out.

The server sets no limits to a head that comes slowly, a body that comes slowly, or an answer that nobody reads; and it
counts such connections among those that it serves. Here they have limits of time, and where too many wait, the one that
has waited for longest goes; those that have carried the secret go last.
"""

from __future__ import annotations

import asyncio
from typing import Any, Final

from uvicorn.protocols.http.h11_impl import H11Protocol

from rocking.explorer.authentication import KNOWN

#: Connections that wait, at most: of a browser's, which opens six, and of everybody else's.
MOST: Final = 100

#: Time for the head of a request, for its body, and for a part of an answer to be taken, s.
HEAD, BODY, ANSWER = 10.0, 120.0, 30.0


class BoundedProtocol(H11Protocol):
    """One connection of the server, with limits."""

    _timer: asyncio.TimerHandle | None = None
    _since = 0.0
    _unsent = 0
    _ended = False

    @property
    def waits(self) -> bool:
        """Whether the other end is waited for: for a request, or until it takes the answer."""
        return not self._ended and (self.cycle is None or self.cycle.response_complete or self.flow.write_paused)

    @property
    def _is_known(self) -> bool:
        """Whether the last request carried the secret."""
        return self.scope is not None and KNOWN in self.scope["state"]

    def connection_made(self, transport: Any) -> None:
        """Begin to wait for a head."""
        super().connection_made(transport)
        self._wait(HEAD)
        self._drop_oldest()

    def connection_lost(self, exc: Exception | None) -> None:
        """Wait no more."""
        self._stop()
        super().connection_lost(exc)

    def handle_events(self) -> None:
        """Take what has come; a body has its own time, and what is computed has as much as it needs."""
        before = self.cycle
        super().handle_events()
        if self.cycle is None or self.cycle.response_complete:
            return
        if not self.cycle.more_body:
            self._stop()
        elif self.cycle is not before:
            self._wait(BODY)

    def on_response_complete(self) -> None:
        """Wait for the next head, and until the answer is taken."""
        self._wait(ANSWER if self.transport.get_write_buffer_size() else HEAD)
        super().on_response_complete()
        self._drop_oldest()

    def pause_writing(self) -> None:
        """Wait until the other end reads on."""
        self._wait(ANSWER)
        super().pause_writing()
        self._drop_oldest()

    def resume_writing(self) -> None:
        """Go on with an answer, for as long as that takes; after its end the next head is waited for."""
        super().resume_writing()
        if self.cycle is not None and not self.cycle.response_complete:
            self._stop()
            if self.cycle.more_body:
                self._wait(BODY)

    def _wait(self, limit: float) -> None:
        self._stop()
        self._since, self._unsent = self.loop.time(), self.transport.get_write_buffer_size()
        self._timer = self.loop.call_later(limit, self._expire)

    def _drop_oldest(self) -> None:
        """End the connection that has waited for longest, if too many wait."""
        waiting = [each for each in self.connections if isinstance(each, BoundedProtocol) and each.waits]
        if len(waiting) > MOST:
            min(waiting, key=lambda each: (each._is_known, each._since))._end()

    def _stop(self) -> None:
        if self._timer is not None:
            self._timer.cancel()

    def _expire(self) -> None:
        if 0 < self.transport.get_write_buffer_size() < self._unsent:
            self._wait(ANSWER)  # slowly, but the answer is being taken
        else:
            self._end()

    def _end(self) -> None:
        """Close the connection, without what the other end has not taken."""
        self._ended = True
        self.transport.abort()
