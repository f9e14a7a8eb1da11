"""Clients of the explorer: of its ASGI application, called directly, and of its server, as the page calls them."""

from collections.abc import Iterator
from contextlib import contextmanager
from urllib.parse import parse_qs, urlsplit

import anyio.from_thread
import httpx

from rocking.explorer.server import EXCHANGE


class Client:
    """Requests to an application, one after the other or from several threads."""

    def __init__(self, portal, application, base_url, headers=None):
        transport = httpx.ASGITransport(application, raise_app_exceptions=False)
        self._portal = portal
        self._client = httpx.AsyncClient(transport=transport, base_url=base_url, headers=headers, timeout=120.0)
        self.headers = self._client.headers

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


def bearing(secret):
    """The header that carries a token or the secret."""
    return {"authorization": f"Bearer {secret}"}


def let_in(client, token, base=""):
    """Exchange a token for the secret, as the page does, and carry it from now on."""
    answer = client.post(base + EXCHANGE, headers=bearing(token))
    assert answer.status_code == 200, answer.text
    client.headers.update(bearing(answer.text))
    return client


def opened_by(link):
    """Open a link as the page does: headers that let requests in, the texts of the link's case, where the server is."""
    parts = urlsplit(link)
    base, (token,) = f"{parts.scheme}://{parts.netloc}", parse_qs(parts.fragment)["token"]
    texts = {name: values[0] for name, values in parse_qs(parts.query).items()}
    with httpx.Client(timeout=60) as client:
        return dict(let_in(client, token, base).headers), texts, base
