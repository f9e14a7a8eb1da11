"""Authentication of requests: one person's browser, on this machine, is let in, and nobody else.

It is an ASGI application outside everything else. Each request, whatever its method and path,

- names this server in its one Host header, else 421: a page of another name that was made to resolve to this address
  (DNS rebinding) does not;
- carries the cookie that the opened link was exchanged for, else 403: other users of the machine do not have it, and
  other sites do not send it (SameSite=Strict);
- and unless it only reads, comes from a page of this server, by its Origin or by Sec-Fetch-Site, else 403.
"""

from __future__ import annotations

import hmac
import secrets
import threading
from collections.abc import Awaitable, Callable, Iterable, MutableMapping
from typing import Any, Final
from urllib.parse import parse_qsl, urlencode

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
Application = Callable[[Scope, Receive, Send], Awaitable[None]]

#: Names of this machine as it calls itself.
LOOPBACK: Final = ("127.0.0.1", "localhost", "[::1]")

#: Links that were made and not opened yet, at most.
_LINKS: Final = 100

_READING: Final = ("GET", "HEAD")

_OTHER_SERVER: Final = "this address is not served here: open the link that rocking explore printed"
_UNKNOWN: Final = (
    "this page needs the link that rocking explore printed, which opens once in one browser: open that link, or start "
    "rocking explore again"
)
_OTHER_PAGE: Final = "only the page of this server may send this"


class RequestAuthentication:
    """ASGI application that passes on to another one what it lets through.

    The server listens at ``port``, and may be called by the names ``hosts``, which are without it.
    """

    def __init__(self, application: Application, port: int, hosts: Iterable[str] = LOOPBACK) -> None:
        self._application = application
        self._hosts = frozenset(f"{host}:{port}".encode() for host in hosts)
        self._cookie = f"rocking-{port}".encode()
        self._secret = secrets.token_urlsafe(32).encode()
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
        elif (token := _token_of(scope)) is not None:
            await self._exchange(scope, send, token)
        elif not self._is_known(scope):
            await _answer(send, 403, _UNKNOWN)
        else:
            await self._application(scope, receive, send)

    def _refused(self, scope: Scope) -> tuple[int, str] | None:
        """Return status and reason if the request names another server or comes from another page."""
        hosts = _values(scope, b"host")
        if len(hosts) != 1 or hosts[0] not in self._hosts:
            return 421, _OTHER_SERVER
        origins, sites = _values(scope, b"origin"), _values(scope, b"sec-fetch-site")
        ours = [b"http://" + hosts[0]]
        if scope["method"] in _READING:
            # A link may lead here from anywhere; what a page loads must be loaded by ours.
            navigates = _values(scope, b"sec-fetch-mode") in ([], [b"navigate"])
            own = origins in ([], ours) and sites in ([], [b"same-origin"], [b"none"])
            return None if own or navigates else (403, _OTHER_PAGE)
        own = origins == ours or (origins == [] and sites == [b"same-origin"])
        return None if own else (403, _OTHER_PAGE)

    def _is_known(self, scope: Scope) -> bool:
        """Whether the request carries the cookie, once."""
        pairs = [pair.strip().partition(b"=") for value in _values(scope, b"cookie") for pair in value.split(b";")]
        sent = [value for name, _, value in pairs if name == self._cookie]
        return len(sent) == 1 and hmac.compare_digest(sent[0], self._secret)

    async def _exchange(self, scope: Scope, send: Send, token: str) -> None:
        """Exchange a token for the cookie, and lead to the page without it; who has the cookie already just goes on."""
        fresh = self._redeemed(token)
        if not fresh and not self._is_known(scope):
            await _answer(send, 403, _UNKNOWN)
            return
        rest = [(name, value) for name, value in _query(scope) if name != "token"]
        headers = [(b"location", b"/" + (f"?{urlencode(rest)}".encode() if rest else b""))]
        if fresh:
            cookie = self._cookie + b"=" + self._secret + b"; HttpOnly; SameSite=Strict; Path=/"
            headers.append((b"set-cookie", cookie))
        await _answer(send, 303, "", headers)

    def _redeemed(self, token: str) -> bool:
        """Whether a token is known and was not used before; it is used then."""
        with self._lock:
            for known in self._tokens:
                if hmac.compare_digest(known.encode(), token.encode()):
                    self._tokens.remove(known)
                    return True
        return False


def _token_of(scope: Scope) -> str | None:
    """Token in the address of the page itself."""
    if scope["method"] != "GET" or scope["path"] != "/":
        return None
    return dict(_query(scope)).get("token")


def _query(scope: Scope) -> list[tuple[str, str]]:
    text = bytes(scope.get("query_string", b"")).decode("ascii", "replace")
    return parse_qsl(text, keep_blank_values=True, errors="replace", max_num_fields=None)


def _values(scope: Scope, name: bytes) -> list[bytes]:
    return [bytes(value) for key, value in scope["headers"] if key.lower() == name]


async def _answer(send: Send, status: int, text: str, headers: Iterable[tuple[bytes, bytes]] = ()) -> None:
    body = text.encode()
    fixed = [
        (b"content-type", b"text/plain; charset=utf-8"),
        (b"content-length", str(len(body)).encode()),
        (b"cache-control", b"no-store"),
        (b"x-content-type-options", b"nosniff"),
        (b"referrer-policy", b"no-referrer"),
    ]
    await send({"type": "http.response.start", "status": status, "headers": [*fixed, *headers]})
    await send({"type": "http.response.body", "body": body})
