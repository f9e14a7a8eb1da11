"""Start of the explorer: socket, link and server."""

from __future__ import annotations

import socket
import threading
import webbrowser
from collections.abc import Mapping
from contextlib import suppress
from importlib import util
from typing import TYPE_CHECKING, Final
from urllib.parse import urlencode

from rocking.core import checks
from rocking.core.threads import set_options
from rocking.errors import OptionError, describe_install

if TYPE_CHECKING:
    from rocking.explorer.core import Explorer

#: Address that only this machine can reach, and maximum number of connections.
LOCAL_ADDRESS: Final = "127.0.0.1"
_MAX_CONNECTIONS: Final = 400

#: Headers of every response.
_HEADERS: Final = [
    ("cache-control", "no-cache"), ("referrer-policy", "no-referrer"), ("x-content-type-options", "nosniff")
]  # fmt: skip


class Server:
    """Server of an explorer that listens on a port of this machine (0: a free one)."""

    def __init__(self, explorer: Explorer, *, port: int = 0) -> None:
        if any(util.find_spec(name) is None for name in ("starlette", "uvicorn")):
            raise OptionError(f"the explorer needs packages that are not installed: {describe_install('explorer')}")
        import uvicorn

        from rocking.explorer.server import App

        checks.integer(port, "port", OptionError, 0, 65535)
        try:
            self.socket = socket.create_server((LOCAL_ADDRESS, port))
        except OSError as error:
            message = f"{{}} {port} cannot be used ({error.strerror}): choose another one"
            raise OptionError(message, "port", value=port) from None
        self.app, self.port = App(explorer), self.socket.getsockname()[1]
        config = uvicorn.Config(
            self.app.asgi, log_level="error", access_log=False, ws="none", timeout_keep_alive=10, headers=_HEADERS,
            limit_concurrency=_MAX_CONNECTIONS, timeout_graceful_shutdown=1,
        )  # fmt: skip
        self.server = uvicorn.Server(config)

    def create_link(self, texts: Mapping[str, str] | None = None, *, path: str = "/") -> str:
        """Return a link that opens the page at a path once, with the texts of a case."""
        query = f"?{urlencode(texts)}" if texts else ""
        return f"http://{LOCAL_ADDRESS}:{self.port}{path}{query}#token={self.app.create_token()}"

    def run(self) -> None:
        """Serve until interrupted."""
        with suppress(KeyboardInterrupt), set_options(progress=False):
            self.server.run(sockets=[self.socket])

    def run_in_background(self) -> None:
        """Serve in a thread that ends with the program."""
        threading.Thread(target=self.run, name="rocking-explorer", daemon=True).start()

    def announce(self, *, open_browser: bool, path: str = "/") -> None:
        """Print the link to a path, and open it in a browser, whose request waits until the server has started."""
        link = self.create_link(path=path)
        print(f"rocking explorer: {link} (once, in one browser; Ctrl-C ends it)", flush=True)
        if open_browser:
            threading.Thread(target=webbrowser.open, args=(link,), daemon=True).start()
