"""Starting the explorer: a socket, the link, the server."""

from __future__ import annotations

import socket
import sys
import threading
import time
import webbrowser
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final
from urllib.parse import urlencode

from rocking.errors import InvalidOption
from rocking.explorer.assets import require_packages
from rocking.explorer.guard import LOOPBACK, Guard
from rocking.progress import note

if TYPE_CHECKING:
    import uvicorn

    from rocking.explorer.core import Explorer
    from rocking.explorer.studies import StudyView

#: Address that nobody but this machine can reach.
HERE: Final = "127.0.0.1"

#: Connections at the same time, and those that wait to be accepted.
_MOST: Final = 200
_WAITING: Final = 128


@dataclass(frozen=True)
class Served:
    """A server that listens, and what it takes to open its page."""

    guard: Guard
    server: uvicorn.Server
    socket: socket.socket
    host: str
    port: int

    def link(self, texts: Mapping[str, str] | None = None, host: str | None = None) -> str:
        """Return a link that opens the page once, with the texts of a case."""
        query = urlencode({**(texts or {}), "token": self.guard.new_token()})
        return f"http://{host or self.host}:{self.port}/?{query}"

    def run(self) -> None:
        """Serve until it is interrupted."""
        with suppress(KeyboardInterrupt):
            self.server.run(sockets=[self.socket])

    def run_in_background(self) -> None:
        """Serve in a thread that ends with the program."""
        threading.Thread(target=self.run, name="rocking-explorer", daemon=True).start()


def served(
    explorer: Explorer,
    opening: Mapping[str, str],
    study: StudyView | None = None,
    *,
    address: str = HERE,
    port: int = 0,
    framed_by: str = "'none'",
) -> Served:
    """Bind the explorer to an address and a port.

    Parameters
    ----------
    explorer, opening, study, framed_by
        As for `rocking.explorer.server.App`.
    address : str
        Address of this machine.
    port : int
        Port; 0 takes one that is free.

    Raises
    ------
    InvalidOption
        If the address cannot be bound, or a package is missing.
    """
    require_packages()
    import uvicorn

    from rocking.explorer.server import App

    listening = _bound(address, port)
    number = int(listening.getsockname()[1])
    own = f"[{address}]" if ":" in address else address
    guard = Guard(App(explorer, opening, study, framed_by).asgi, number, {*LOOPBACK, own})
    config = uvicorn.Config(
        guard,
        log_level="error",
        access_log=False,
        ws="none",
        http="h11",
        server_header=False,
        limit_concurrency=_MOST,
        timeout_graceful_shutdown=1,
        proxy_headers=False,
    )
    return Served(guard, uvicorn.Server(config), listening, own, number)


def announce_and_open(here: Served, texts: Mapping[str, str], *, open_browser: bool) -> None:
    """Print the one line with the link, and open it in a browser once the server answers."""
    link = here.link(texts)
    print(f"rocking explorer: {link} (once, in one browser; Ctrl-C ends it)", flush=True)
    if open_browser:
        threading.Thread(target=_open, args=(here, link), daemon=True).start()


def _open(here: Served, link: str) -> None:
    while not here.server.started:
        time.sleep(0.02)
    webbrowser.open(link)


def _bound(address: str, port: int) -> socket.socket:
    if not 0 <= port <= 65535:
        raise InvalidOption(f"port must be a whole number from 0 to 65535, not {port}")
    if address in ("0.0.0.0", "::", ""):
        raise InvalidOption(f"address {address!r} is every address of this machine: name the one that others shall use")
    if address not in (HERE, "localhost", "::1"):
        note(f"{address} can be reached from other machines, and what is sent is not encrypted")
    try:
        family, kind, _, _, place = socket.getaddrinfo(address, port, type=socket.SOCK_STREAM)[0]
    except OSError as error:
        raise InvalidOption(f"{address} is no address of this machine: {error.strerror}") from None
    listening = socket.socket(family, kind)
    try:
        if sys.platform != "win32":
            listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        listening.bind(place)
        listening.listen(_WAITING)
    except OSError as error:
        listening.close()
        raise InvalidOption(f"port {port} of {address} cannot be used: {error.strerror}; choose another port") from None
    return listening
