"""Start of the explorer: socket, link and server, for the command line and for notebooks."""

from __future__ import annotations

import socket
import threading
import webbrowser
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from html import escape
from importlib import util
from typing import TYPE_CHECKING, Final
from urllib.parse import urlencode

from rocking.core import checks
from rocking.core.threads import set_options
from rocking.errors import OptionError, describe_install
from rocking.response import Response

if TYPE_CHECKING:
    import uvicorn

    from rocking.explorer.core import Explorer
    from rocking.explorer.server import App

#: Address that only this machine can reach, and maximum number of connections.
LOCAL_ADDRESS: Final = "127.0.0.1"
_MAX_CONNECTIONS: Final = 400


def require_packages() -> None:
    """Raise `OptionError` unless the packages of the explorer are installed."""
    if any(util.find_spec(name) is None for name in ("starlette", "uvicorn")):
        raise OptionError(f"the explorer needs packages that are not installed: {describe_install('explorer')}")


@dataclass(frozen=True)
class Server:
    """Listening server with its application."""

    app: App
    server: uvicorn.Server
    socket: socket.socket
    port: int

    def link(self, texts: Mapping[str, str] | None = None, *, path: str = "/") -> str:
        """Return a link that opens the page at a path once, with the texts of a case."""
        query = f"?{urlencode(texts)}" if texts else ""
        return f"http://{LOCAL_ADDRESS}:{self.port}{path}{query}#token={self.app.new_token()}"

    def run(self) -> None:
        """Serve until interrupted."""
        with suppress(KeyboardInterrupt), set_options(progress=False):
            self.server.run(sockets=[self.socket])

    def run_in_background(self) -> None:
        """Serve in a thread that ends with the program."""
        threading.Thread(target=self.run, name="rocking-explorer", daemon=True).start()

    def announce(self, *, open_browser: bool, path: str = "/") -> None:
        """Print the link to a path, and open it in a browser, whose request waits until the server has started."""
        link = self.link(path=path)
        print(f"rocking explorer: {link} (once, in one browser; Ctrl-C ends it)", flush=True)
        if open_browser:
            threading.Thread(target=webbrowser.open, args=(link,), daemon=True).start()


def start_listening(explorer: Explorer, *, port: int = 0, framed_by: str = "'none'") -> Server:
    """Bind the explorer's application to a port of this machine (0: a free one)."""
    require_packages()
    import uvicorn

    from rocking.explorer.server import App

    checks.integer(port, "port", OptionError, 0, 65535)
    try:
        listener = socket.create_server((LOCAL_ADDRESS, port))
    except OSError as error:
        message = f"{{}} {port} cannot be used ({error.strerror}): choose another one"
        raise OptionError(message, "port", value=port) from None
    app = App(explorer, framed_by)
    config = uvicorn.Config(
        app.asgi, log_level="error", access_log=False, ws="none", timeout_keep_alive=10,
        limit_concurrency=_MAX_CONNECTIONS, timeout_graceful_shutdown=1,
    )  # fmt: skip
    return Server(app, uvicorn.Server(config), listener, listener.getsockname()[1])


@dataclass(frozen=True)
class Frame:
    """Page of a response, shown in a frame of a notebook.

    Attributes
    ----------
    texts : dict of str to str
        Case in the format of the page's address.
    height : int
        Height of the frame, pixels.
    new_link : callable
        Function that returns a new link to the page of a case.

    See Also
    --------
    rocking.explore : Create a frame from a response.

    Examples
    --------
    >>> import rocking
    >>> response = rocking.simulate(rocking.Block(width=0.4, height=2.0), rocking.pulses.one_sine(3.0, 1.0))
    >>> frame = rocking.explore(response, height=600)
    >>> frame.texts["motion"], frame.height
    ('one-sine:amplitude=3.0,frequency=1.0', 600)
    """

    texts: dict[str, str]
    height: int
    new_link: Callable[[Mapping[str, str]], str] = field(repr=False)

    @property
    def link(self) -> str:
        """Return a link that opens the page once, in a browser on this machine."""
        return self.new_link(self.texts)

    def _repr_html_(self) -> str:
        style = f"width:100%;height:{self.height}px;border:0"
        return f'<iframe title="rocking explorer" src="{escape(self.link)}" style="{style}"></iframe>'


_lock = threading.Lock()
_running: tuple[Explorer, Server] | None = None


def explore(response: Response, *, height: int = 760) -> Frame:
    """Show a response in the explorer, in a frame of the notebook.

    This process serves the page on 127.0.0.1 until it ends.

    Parameters
    ----------
    response : Response
        Result of `rocking.simulate`.
    height : int
        Height of the frame, pixels.

    Returns
    -------
    Frame
        Frame that is displayed as the last line of a cell; `link` opens the page in a browser.

    Raises
    ------
    OptionError
        If `response` is not a response, or a package of the ``explorer`` extra is missing.

    See Also
    --------
    simulate : Simulate one block under one motion.

    Examples
    --------
    >>> import rocking
    >>> response = rocking.simulate(rocking.Block(width=0.24, height=1.1), rocking.pulses.one_sine(3.0, 1.0))
    >>> rocking.explore(response).texts["width"]
    '0.24'
    """
    if not isinstance(response, Response):
        raise OptionError(
            f"{{}} must be a Response, as rocking.simulate returns it, not a {type(response).__name__}", "response"
        )
    from rocking.explorer.inputs import response_to_texts

    explorer, server = _get_shared_server()
    return Frame(response_to_texts(response, explorer.uploads), height, server.link)


def _get_shared_server() -> tuple[Explorer, Server]:
    """Return the server of this process; the first call starts it."""
    global _running
    from rocking.explorer.core import Explorer

    with _lock:
        if _running is None:
            explorer = Explorer()
            # notebooks served by this machine
            server = start_listening(explorer, framed_by="http://localhost:* http://127.0.0.1:*")
            server.run_in_background()
            _running = explorer, server
        return _running
