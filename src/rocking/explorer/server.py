"""Web application: passes requests to the explorer, and sends its answers."""

from __future__ import annotations

import hmac
import os
import secrets
import struct
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any, Final

from starlette.applications import Starlette
from starlette.background import BackgroundTask
from starlette.concurrency import run_in_threadpool
from starlette.requests import ClientDisconnect, Request
from starlette.responses import HTMLResponse, JSONResponse, PlainTextResponse, Response, StreamingResponse
from starlette.routing import Mount, Route
from starlette.staticfiles import StaticFiles

from rocking.core.tables import to_plain
from rocking.errors import RockingError
from rocking.explorer.core import Explorer, Query, Stream
from rocking.explorer.parameters import find_field_label
from rocking.explorer.payload import Payload, fill_page, load_english_texts, pack
from rocking.explorer.standalone import build_page
from rocking.explorer.uploads import MAX_FILE_SIZE, SIZE_ADVICE

#: Path that exchanges the token of a link for the secret.
EXCHANGE: Final = "/api/secret"

#: Maximum number of unopened links.
_MAX_LINKS: Final = 100

_BINARY_TYPE: Final = "application/octet-stream"

#: Policies of both pages.
_BLOCK_POLICY: Final = "frame-ancestors 'none'"
_POLICY: Final = (
    "default-src 'none'; script-src 'self'; connect-src 'self'; style-src 'self'; img-src 'self' data: blob:; "
    f"base-uri 'none'; form-action 'none'; {_BLOCK_POLICY}"
)

#: Folder of the page's own files.
FOLDER: Final = Path(__file__).with_name("page")

_LINK_REQUIRED: Final = (
    "this page requires the link that rocking explore printed, which opens once; open it, or start rocking explore "
    "again"
)


class App:
    """Application that answers requests by an explorer.

    The page and its files are the same for all users, and public. Every other request must carry the secret in its
    Authorization header. A link contains a token behind ``#``, a part that browsers never send. The page exchanges the
    token once for the secret, and stores the secret in the storage of its origin, so that a reload and another tab have
    it. Pages of other origins can neither read it nor send this header without permission, which is never granted.
    """

    def __init__(self, explorer: Explorer) -> None:
        self.explorer = explorer
        self._secret, self._tokens = secrets.token_urlsafe(32), list[str]()
        self._html = fill_page(FOLDER.joinpath("index.html").read_text("utf-8"), load_english_texts())
        self.asgi = Starlette(
            routes=[
                Route("/", self._send_page),
                Route("/block", self._send_block),
                Mount("/page", _PageFiles(directory=FOLDER)),
                Route(EXCHANGE, self._exchange, methods=["POST"]),
                Route("/api/files", self._receive_file, methods=["POST"]),
                *(Route(f"/api/{name}", self._answer(name)) for name in explorer.answers),
            ],
            exception_handlers={RockingError: _respond_invalid, Exception: _respond_failure},
        )
        self.asgi.router.redirect_slashes = False

    def create_token(self) -> str:
        """Return a token that opens the page once."""
        self._tokens = [*self._tokens[-_MAX_LINKS + 1 :], secrets.token_urlsafe(32)]
        return self._tokens[-1]

    def _send_page(self, _: Request) -> Response:
        return HTMLResponse(self._html, headers={"content-security-policy": _POLICY})

    def _send_block(self, _: Request) -> Response:
        """Return the standalone page, which leads to this one."""
        return HTMLResponse(_build_block_page(), headers={"content-security-policy": _BLOCK_POLICY})

    async def _exchange(self, request: Request) -> Response:
        """Return the secret for an unused token."""
        token = next((token for token in self._tokens if _has_credentials(request, token)), None)
        if token is None:
            return _respond_problem(_LINK_REQUIRED, 403)
        self._tokens.remove(token)
        return PlainTextResponse(self._secret)

    def _answer(self, name: str) -> Callable[[Request], Response]:
        """Return a handler that sends the explorer's answer; Starlette runs it in a thread."""

        def respond(request: Request) -> Response:
            if not _has_credentials(request, self._secret):
                return _respond_problem(_LINK_REQUIRED, 403)
            answer = self.explorer.answers[name](Query(request.query_params))
            if isinstance(answer, Stream):
                parts = _encode_parts(answer, request.query_params.get("motion", ""))
                close = BackgroundTask(answer.parts.close)  # also when the reader disconnects
                return StreamingResponse(parts, media_type=_BINARY_TYPE, background=close)
            if isinstance(answer, Payload | bytes):
                return Response(answer if isinstance(answer, bytes) else pack(answer), media_type=_BINARY_TYPE)
            return JSONResponse(to_plain(answer))

        return respond

    async def _receive_file(self, request: Request) -> Response:
        """Store the body of a request as a file, and describe it."""
        if not _has_credentials(request, self._secret):
            return _respond_problem(_LINK_REQUIRED, 403)
        data = bytearray()
        if int(request.headers.get("content-length", 0)) > MAX_FILE_SIZE:  # a number: uvicorn accepts nothing else
            return _respond_problem(SIZE_ADVICE, 413)
        try:
            async for chunk in request.stream():
                data += chunk
                if len(data) > MAX_FILE_SIZE:
                    return _respond_problem(SIZE_ADVICE, 413)
        except ClientDisconnect:
            return Response(status_code=400)
        name = request.query_params.get("name", "")
        return JSONResponse(to_plain(await run_in_threadpool(self.explorer.add_file, name, bytes(data))))


class _PageFiles(StaticFiles):
    """Files of the page except its templates; some versions of Starlette fail at a path with a zero byte."""

    def lookup_path(self, path: str) -> tuple[str, os.stat_result | None]:
        """Return the path of a file and its status, None if there is no such file."""
        return ("", None) if path.endswith(".html") or "\0" in path else super().lookup_path(path)


@cache
def _build_block_page() -> str:
    return build_page(served=True)


def _has_credentials(request: Request, credentials: str) -> bool:
    """Whether the Authorization header of a request contains these credentials."""
    header = request.headers.get("authorization", "")
    return hmac.compare_digest(header.encode(), f"Bearer {credentials}".encode())


def _encode_parts(stream: Stream, motion: str) -> Iterator[bytes]:
    """Yield payloads behind their lengths."""

    def encode(payload: Payload) -> bytes:
        data = pack(payload)
        return struct.pack("<Q", len(data)) + data

    yield encode(Payload(stream.description))
    try:
        yield from map(encode, stream.parts)
    except RockingError as error:
        yield encode(Payload(_describe_error(error, motion)))


def _describe_error(error: RockingError, motion: str) -> dict[str, Any]:
    """Return the message of an error, with the page's names of the fields, and the argument."""
    return {"problem": error.text(lambda name: find_field_label(name, motion)), "argument": error.argument}


def _respond_problem(problem: str, status: int) -> Response:
    return JSONResponse({"problem": problem, "argument": None}, status)


async def _respond_invalid(request: Request, error: Exception) -> Response:
    assert isinstance(error, RockingError)
    return JSONResponse(_describe_error(error, request.query_params.get("motion", "")), 422)


async def _respond_failure(_: Request, error: Exception) -> Response:
    return _respond_problem(f"this could not be computed ({type(error).__name__}); please report it", 500)
