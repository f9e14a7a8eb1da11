"""Authentication of requests: one person's browser, on this machine, is let in, and nobody else.

It is an ASGI application outside everything else. Each request, whatever its method and path,

- names this server in its one Host header, else 421;
- has no Origin header, or one that names this server, else 403; and where it does more than read, it has that header,
  or Sec-Fetch-Site says that a page of this server sends it;
- and carries the secret in its Authorization header, else 403, unless it only reads the page or one of its files, which
  are the same for everybody and say nothing of what is shown.

The link that opens the page carries a token, in the part behind ``#``, which no browser sends: it is in no log and in
no referrer. The page sends it once, in a header, takes it out of its address, and gets the secret for it, which it
keeps in the storage of its origin (`page/secret.js`): so a reload, another tab, a bookmark and a notebook's frame know
it, and pages of other ports do not, as they would know a cookie, which has no port. The secret ends with the server.

Who is kept out, and by what:

- other users and programs of this machine, who reach the port, read its traffic nowhere and see no headers: they have
  no secret. A token is spent by whoever comes first, and who comes second is told so;
- pages of other sites, of other ports and of sandboxed frames (Origin: null): they cannot read the secret, a browser
  adds no header by itself, and asks first whether a page may (an OPTIONS request, which is refused);
- a page of another name that was made to resolve to this address (DNS rebinding): its Host is another;
- whoever serves another port, or the same one later: a browser sends neither secret nor token there by itself, and the
  secret that it may have kept opens nothing any more.

Who is not kept out: programs of the same person; an administrator; whoever reads the line that was printed, or the
arguments of the browser that was started with the link, before the page has opened; and, where another address than
this machine's own was asked for, whoever reads the network.
"""

from __future__ import annotations

import hmac
import secrets
import threading
from collections.abc import Awaitable, Callable, Iterable, MutableMapping
from typing import Any, Final

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
Application = Callable[[Scope, Receive, Send], Awaitable[None]]

#: Names of this machine as it calls itself.
LOOPBACK: Final = ("127.0.0.1", "localhost", "[::1]")

#: Where a token is exchanged for the secret.
EXCHANGE: Final = "/api/secret"

#: Links that were made and not opened yet, at most.
_LINKS: Final = 100

_READING: Final = ("GET", "HEAD")

_UNKNOWN: Final = (
    "this page needs the link that rocking explore printed, which opens once in one browser: open that link, or start "
    "rocking explore again; in a notebook, run the cell again"
)


class RequestAuthentication:
    """ASGI application that passes on what it lets through, called at ``port`` by the names ``hosts``."""

    def __init__(self, application: Application, port: int, hosts: Iterable[str] = LOOPBACK) -> None:
        self._application = application
        # Browsers write names in lower case, and leave out the port that they assume.
        names = [host.lower().encode() for host in hosts]
        # The port of an address that names none.
        self._hosts = frozenset([b"%s:%d" % (name, port) for name in names] + (names if port == 80 else []))
        self._secret = secrets.token_urlsafe(32)
        self._tokens: list[str] = []
        self._lock = threading.Lock()

    def new_token(self) -> str:
        """Return a token that opens the page once."""
        token = secrets.token_urlsafe(32)
        with self._lock:
            self._tokens = [*self._tokens[-_LINKS + 1 :], token]
        return token

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or answer it with what is wrong."""
        if scope["type"] == "lifespan":
            await self._application(scope, receive, send)
        elif scope["type"] != "http":
            await send({"type": "websocket.close", "code": 1008})
        elif (refused := self._refused(scope)) is not None:
            await _answer(send, *refused)
        elif scope["path"] == EXCHANGE and scope["method"] == "POST":
            await _answer(send, *((200, self._secret) if self._redeemed(_bearer(scope)) else (403, _UNKNOWN)))
        elif hmac.compare_digest(_bearer(scope), self._secret.encode()) or _is_public(scope):
            await self._application(scope, receive, send)
        else:
            await _answer(send, 403, _UNKNOWN)

    def _refused(self, scope: Scope) -> tuple[int, str] | None:
        """Return status and reason if the request names another server or comes from another page."""
        hosts = _values(scope, b"host")
        if len(hosts) != 1 or hosts[0] not in self._hosts:
            return 421, "this address is not served here: open the link that rocking explore printed"
        origins, sites = _values(scope, b"origin"), _values(scope, b"sec-fetch-site")
        ours = [b"http://" + hosts[0]]
        if scope["method"] in _READING:
            # A link may lead here from anywhere; what a page loads must be loaded by ours.
            navigates = _values(scope, b"sec-fetch-mode") == [b"navigate"]
            own = origins in ([], ours) and (navigates or sites in ([], [b"same-origin"], [b"none"]))
        else:
            own = origins == ours or (origins == [] and sites == [b"same-origin"])
        return None if own else (403, "only the page of this server may send this")

    def _redeemed(self, token: bytes) -> bool:
        """Whether a token is known and was not used before; it is used then."""
        with self._lock:
            for known in self._tokens:
                if hmac.compare_digest(known.encode(), token):
                    self._tokens.remove(known)
                    return True
        return False


def _is_public(scope: Scope) -> bool:
    """Whether a request only reads the page or one of its files."""
    path = scope["path"]
    return scope["method"] in _READING and (path == "/" or path.startswith(("/page/", "/library/")))


def _bearer(scope: Scope) -> bytes:
    """Return what the one Authorization header carries; nothing where there is none, or another number of them."""
    values = _values(scope, b"authorization")
    scheme, _, carried = values[0].partition(b" ") if len(values) == 1 else (b"", b"", b"")
    return carried if scheme == b"Bearer" else b""


def _values(scope: Scope, name: bytes) -> list[bytes]:
    return [bytes(value) for key, value in scope["headers"] if key.lower() == name]


async def _answer(send: Send, status: int, text: str) -> None:
    body = text.encode()
    headers = [
        (b"content-type", b"text/plain; charset=utf-8"),
        (b"content-length", str(len(body)).encode()),
        (b"cache-control", b"no-store"),
        (b"x-content-type-options", b"nosniff"),
        (b"referrer-policy", b"no-referrer"),
    ]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})
