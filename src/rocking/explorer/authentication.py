"""Authentication of requests: only the browser of one user on this machine has access.

This is an ASGI application around all others. Each request, whatever its method and path,

- names this server in exactly one Host header, else 421;
- has no Origin header, or one that names this server, else 403. Requests that do more than read require this header,
  or a Sec-Fetch-Site header that names a page of this server as the sender;
- contains the secret in its Authorization header, else 403, unless it only reads the page or one of its files, which
  are the same for all users and reveal nothing of the displayed case.

The link that opens the page contains a token behind ``#``, a part that browsers never send, so it appears in no log
and no referrer. The page sends the token once, in a header, removes it from its address, and receives the secret, which
it stores in the storage of its origin (`page/secret.js`). Therefore a reload, another tab, a bookmark and a notebook's
frame have the secret, and pages of other ports do not, whereas cookies are shared between ports. The secret expires
with the server.

Who is denied access, and how:

- other users and programs of this machine, who reach the port but read no traffic and see no headers: they lack the
  secret. The first user of a token spends it, and the second is informed;
- pages of other sites, of other ports and of sandboxed frames (Origin: null): they cannot read the secret, and a
  browser adds no header by itself and first requests permission (OPTIONS), which is refused;
- a page of another name that was made to resolve to this address (DNS rebinding): its Host differs;
- another server on another port, or later on the same one: browsers send it neither secret nor token, and a secret
  that it may have stored is no longer valid.

Who is not denied access: programs of the same user; an administrator; anyone who reads the printed line, or the
arguments of the browser that was started with the link, before the page has opened; and, for other addresses than this
machine's own, anyone who reads the network.
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

#: Names that this machine uses for itself.
LOOPBACK: Final = ("127.0.0.1", "localhost", "[::1]")

#: Path that exchanges a token for the secret.
EXCHANGE: Final = "/api/secret"

#: Maximum number of unopened links.
_MAX_LINKS: Final = 100

_READ_METHODS: Final = ("GET", "HEAD")

_LINK_REQUIRED: Final = (
    "this page needs the link that rocking explore printed, which opens once in one browser: open that link, or start "
    "rocking explore again; in a notebook, run the cell again"
)


class RequestAuthentication:
    """ASGI application that passes on authenticated requests to ``port`` at the names ``hosts``."""

    def __init__(self, application: Application, port: int, hosts: Iterable[str] = LOOPBACK) -> None:
        self._application = application
        # Browsers write names in lower case, and omit the default port.
        names = [host.lower().encode() for host in hosts]
        # The default port of an address.
        self._hosts = frozenset([b"%s:%d" % (name, port) for name in names] + (names if port == 80 else []))
        self._secret = secrets.token_urlsafe(32)
        self._tokens: list[str] = []
        self._lock = threading.Lock()

    def new_token(self) -> str:
        """Return a token that opens the page once."""
        token = secrets.token_urlsafe(32)
        with self._lock:
            self._tokens = [*self._tokens[-_MAX_LINKS + 1 :], token]
        return token

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Pass a request on, or answer it with the error."""
        if scope["type"] == "lifespan":
            await self._application(scope, receive, send)
        elif scope["type"] != "http":
            await send({"type": "websocket.close", "code": 1008})
        elif (refusal := self._find_refusal(scope)) is not None:
            await _respond(send, *refusal)
        elif scope["path"] == EXCHANGE and scope["method"] == "POST":
            await _respond(send, *((200, self._secret) if self._redeem(_read_bearer(scope)) else (403, _LINK_REQUIRED)))
        elif hmac.compare_digest(_read_bearer(scope), self._secret.encode()) or _is_public(scope):
            await self._application(scope, receive, send)
        else:
            await _respond(send, 403, _LINK_REQUIRED)

    def _find_refusal(self, scope: Scope) -> tuple[int, str] | None:
        """Return status and reason if the request names another server or comes from another page."""
        hosts = _read_headers(scope, b"host")
        if len(hosts) != 1 or hosts[0] not in self._hosts:
            return 421, "this address is not served here: open the link that rocking explore printed"
        origins, sites = _read_headers(scope, b"origin"), _read_headers(scope, b"sec-fetch-site")
        own_origins = [b"http://" + hosts[0]]
        if scope["method"] in _READ_METHODS:
            # Links may lead here from anywhere, but resources must be loaded by this page.
            navigates = _read_headers(scope, b"sec-fetch-mode") == [b"navigate"]
            is_allowed = origins in ([], own_origins) and (navigates or sites in ([], [b"same-origin"], [b"none"]))
        else:
            is_allowed = origins == own_origins or (origins == [] and sites == [b"same-origin"])
        return None if is_allowed else (403, "only the page of this server may send this")

    def _redeem(self, token: bytes) -> bool:
        """Whether a token is valid and unused, and mark it as used."""
        with self._lock:
            for valid_token in self._tokens:
                if hmac.compare_digest(valid_token.encode(), token):
                    self._tokens.remove(valid_token)
                    return True
        return False


def _is_public(scope: Scope) -> bool:
    """Whether a request only reads the page or one of its files."""
    path = scope["path"]
    return scope["method"] in _READ_METHODS and (path in ("/", "/block") or path.startswith(("/page/", "/library/")))


def _read_bearer(scope: Scope) -> bytes:
    """Return the content of a single Authorization header; empty if there is none or several."""
    values = _read_headers(scope, b"authorization")
    scheme, _, credentials = values[0].partition(b" ") if len(values) == 1 else (b"", b"", b"")
    return credentials if scheme == b"Bearer" else b""


def _read_headers(scope: Scope, name: bytes) -> list[bytes]:
    return [bytes(value) for key, value in scope["headers"] if key.lower() == name]


async def _respond(send: Send, status: int, text: str) -> None:
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
