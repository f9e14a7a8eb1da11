"""A client that calls an ASGI application directly, as a browser with cookies would call its server."""

from collections.abc import Iterator
from contextlib import contextmanager

import anyio.from_thread
import httpx


class Client:
    """Requests to an application, one after the other or from several threads."""

    def __init__(self, portal, application, base_url, headers=None, *, follow=False):
        transport = httpx.ASGITransport(application, raise_app_exceptions=False)
        self._portal = portal
        self._client = httpx.AsyncClient(
            transport=transport, base_url=base_url, headers=headers, follow_redirects=follow, timeout=120.0
        )
        self.cookies = self._client.cookies

    def request(self, method, path, **given):
        return self._portal.call(lambda: self._client.request(method, path, **given))

    def get(self, path, **given):
        return self.request("GET", path, **given)

    def post(self, path, **given):
        return self.request("POST", path, **given)


@contextmanager
def clients() -> Iterator[anyio.from_thread.BlockingPortal]:
    """Where clients run."""
    with anyio.from_thread.start_blocking_portal() as portal:
        yield portal
