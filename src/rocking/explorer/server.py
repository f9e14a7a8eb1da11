"""Web application: converts requests to calls of the explorer, and payloads to bytes."""

from __future__ import annotations

import hmac
import math
import secrets
import struct
from collections.abc import AsyncIterator, Awaitable, Callable, Generator, Mapping
from functools import cache, cached_property
from importlib import resources
from importlib.resources.abc import Traversable
from typing import Any, Final, NamedTuple, TypeVar

import anyio
import anyio.to_thread
from starlette.applications import Starlette
from starlette.requests import ClientDisconnect, Request
from starlette.responses import JSONResponse, Response, StreamingResponse
from starlette.routing import Route

from rocking.core.tables import to_plain
from rocking.errors import OptionError, RockingError
from rocking.explorer import assessment, maps, periodic
from rocking.explorer.catalogue import list_records, read_entries
from rocking.explorer.code import map_as_python, sweep_as_python
from rocking.explorer.core import EXPORTS, Explorer
from rocking.explorer.inputs import Case, read_case
from rocking.explorer.parameters import PARAMETERS, QUANTITIES, field_label, specification
from rocking.explorer.payload import Payload, fill_page, load_english_texts, pack
from rocking.explorer.standalone import build_page, is_available
from rocking.explorer.studies import StudyView
from rocking.explorer.uploads import MAX_FILE_SIZE, TOO_LARGE
from rocking.inputs.quantities import read_number

T = TypeVar("T")

#: Path that exchanges the token of a link for the secret.
EXCHANGE: Final = "/api/secret"

#: Maximum number of unopened links.
_MAX_LINKS: Final = 100

#: Content types of the page's own files.
CONTENT_TYPES: Final = {
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".svg": "image/svg+xml",
}

_HEADERS: Final = {"x-content-type-options": "nosniff", "referrer-policy": "no-referrer", "cache-control": "no-store"}

_LINK_REQUIRED: Final = (
    "this page requires the link that rocking explore printed, which opens once; open it, or start rocking explore "
    "again; in a notebook, run the cell again"
)


def page_files() -> dict[str, bytes]:
    """Return the page's own files by path."""

    def walk(folder: Traversable, path: str) -> dict[str, bytes]:
        files: dict[str, bytes] = {}
        for entry in folder.iterdir():
            files |= walk(entry, f"{path}{entry.name}/") if entry.is_dir() else {path + entry.name: entry.read_bytes()}
        return files

    return walk(resources.files("rocking.explorer") / "page", "")


class Query:
    """Query of an address, parsed on access."""

    def __init__(self, fields: Mapping[str, str]) -> None:
        self.fields = fields
        self.texts = {name: fields[name] for name in PARAMETERS if fields.get(name)}

    @cached_property
    def others(self) -> dict[str, str]:
        """All texts that do not belong to the case."""
        return {name: value for name, value in self.fields.items() if name not in PARAMETERS}

    def numbers(self, first: str, second: str) -> tuple[float, float]:
        """Return two required finite numbers."""
        texts = [self.fields.get(name, "")[:40] for name in (first, second)]
        low, high = (read_number(text, name) for text, name in zip(texts, (first, second), strict=True))
        if not (math.isfinite(low) and math.isfinite(high)):
            raise OptionError("{} and {} must be finite numbers", first, second)
        return low, high

    @property
    def window(self) -> tuple[float, float] | None:
        """Ends of a time window, s, or None if they are missing."""
        return self.numbers("from", "to") if self.fields.get("from") and self.fields.get("to") else None


class Download(NamedTuple):
    """File to save: its form, one of `EXPORTS`, and its content."""

    form: str
    content: bytes


class Stream(NamedTuple):
    """Response in parts: a description, then the parts in the order of their computation."""

    description: dict[str, Any]
    parts: Generator[Payload]


class App:
    """Application; ``opening`` contains the texts of the initial case, ``framed_by`` the pages that may frame it.

    The page and its files are the same for all users, and public. Every other request must carry the secret in its
    Authorization header. A link contains a token behind ``#``, a part that browsers never send. The page exchanges the
    token once for the secret, and stores the secret in the storage of its origin, so that a reload and another tab have
    it. Pages of other origins can neither read it nor send this header without permission, which is never granted.
    """

    def __init__(
        self, explorer: Explorer, opening: Mapping[str, str], study: StudyView | None = None, framed_by: str = "'none'"
    ) -> None:
        self.explorer, self.opening, self.study = explorer, dict(opening), study
        self._framed_by = framed_by
        self._secret, self._tokens = secrets.token_urlsafe(32), list[str]()
        self._files = page_files()
        self._html = fill_page(self._files["index.html"].decode(), load_english_texts())
        self._page_headers = _HEADERS | {
            "content-security-policy": "default-src 'none'; script-src 'self'; connect-src 'self'; style-src 'self'; "
            f"img-src 'self' data: blob:; base-uri 'none'; form-action 'none'; frame-ancestors {framed_by}"
        }
        self._threads, self._streams = anyio.CapacityLimiter(4), anyio.CapacityLimiter(2)
        uploads = explorer.uploads
        computations: dict[str, Callable[[Query], Any]] = {
            "/api/start": lambda query: self._describe_page(),
            "/api/case": lambda query: explorer.case(query.texts, query.window),
            "/api/details": lambda query: explorer.details(query.texts, query.window),
            "/api/at": lambda query: explorer.state(query.texts, query.fields.get("at", ""), query.window),
            "/api/export": self._export,
            "/api/map": self._stream_map,
            "/api/map/point": lambda query: maps.map_point_to_texts(
                self._read_grid(query), *query.numbers("at_x", "at_y")
            ),
            "/api/orbit": lambda query: periodic.describe_orbit(self._read_case(query)),
            "/api/sweep": self._stream_sweep,
            "/api/sweep/point": self._find_sweep_texts,
            "/api/list": lambda query: list_records(uploads, read_entries(query.fields.get("answers", ""))),
            "/api/remove": lambda query: explorer.remove(query.fields.get("key", "")),
            "/api/assessment": self._stream_assessment,
            "/api/study": lambda query: self._require_study().slice(query.others),
            "/api/study/point": lambda query: self._require_study().point_to_texts(query.others, uploads),
        }
        self.asgi = Starlette(
            routes=[
                Route("/", self._send_page),
                Route("/block", self._send_block),
                Route("/page/{path:path}", self._send_file),
                Route(EXCHANGE, self._exchange, methods=["POST"]),
                Route("/api/files", self._guard(self._receive_file), methods=["POST"]),
                *(Route(path, self._guard(self._respond_with(compute))) for path, compute in computations.items()),
            ],
            exception_handlers={RockingError: _respond_invalid, Exception: _respond_failure},
        )
        self.asgi.router.redirect_slashes = False

    def new_token(self) -> str:
        """Return a token that opens the page once."""
        self._tokens = [*self._tokens[-_MAX_LINKS + 1 :], secrets.token_urlsafe(32)]
        return self._tokens[-1]

    async def _send_page(self, _: Request) -> Response:
        return Response(self._html, media_type="text/html", headers=self._page_headers)

    async def _send_block(self, _: Request) -> Response:
        """Return the standalone page, which leads to this one."""
        html = await self._run_in_thread(_build_block_page)
        headers = {**_HEADERS, "content-security-policy": f"frame-ancestors {self._framed_by}"}
        return Response(html, media_type="text/html", headers=headers)

    async def _send_file(self, request: Request) -> Response:
        path = request.path_params["path"]
        content_type = CONTENT_TYPES.get(path[path.rfind(".") :])
        if content_type is None or path not in self._files:
            return Response("there is no such file", 404, _HEADERS, "text/plain")
        return Response(self._files[path], media_type=content_type, headers=_HEADERS | {"cache-control": "no-cache"})

    async def _exchange(self, request: Request) -> Response:
        """Return the secret for an unused token."""
        token = next((token for token in self._tokens if _carries(request, token)), None)
        if token is None:
            return _respond_problem(_LINK_REQUIRED, 403)
        self._tokens.remove(token)
        return Response(self._secret, headers=_HEADERS, media_type="text/plain")

    def _guard(self, respond: Callable[[Request], Awaitable[Response]]) -> Callable[[Request], Awaitable[Response]]:
        """Return a handler that requires the secret."""

        async def check(request: Request) -> Response:
            return await respond(request) if _carries(request, self._secret) else _respond_problem(_LINK_REQUIRED, 403)

        return check

    def _respond_with(self, compute: Callable[[Query], Any]) -> Callable[[Request], Awaitable[Response]]:
        """Return a handler that responds with a payload, a stream, a file, or plain values, computed in a thread."""

        async def respond(request: Request) -> Response:
            result = await self._run_in_thread(lambda: compute(Query(request.query_params)))
            if isinstance(result, Payload):
                return Response(pack(result), media_type="application/octet-stream", headers=_HEADERS)
            if isinstance(result, Stream):
                parts = self._encode_parts(result, request.query_params.get("motion", ""))
                return StreamingResponse(parts, media_type="application/octet-stream", headers=_HEADERS)
            if isinstance(result, Download):
                return Response(result.content, media_type=EXPORTS[result.form], headers=_HEADERS)
            return JSONResponse(to_plain(result), headers=_HEADERS)

        return respond

    async def _run_in_thread(self, compute: Callable[[], T]) -> T:
        return await anyio.to_thread.run_sync(compute, limiter=self._threads)

    async def _encode_parts(self, stream: Stream, motion: str) -> AsyncIterator[bytes]:
        """Yield payloads behind their lengths; the computation stops when the reader disconnects."""

        def encode_next() -> bytes | None:
            try:
                part = next(stream.parts, None)
            except RockingError as error:
                part = Payload(_describe_error(error, motion))
            return None if part is None else _add_length(pack(part))

        yield _add_length(pack(Payload(stream.description)))
        async with self._streams:
            try:
                while (data := await anyio.to_thread.run_sync(encode_next)) is not None:
                    yield data
            finally:
                with anyio.CancelScope(shield=True):
                    await anyio.to_thread.run_sync(stream.parts.close)

    async def _receive_file(self, request: Request) -> Response:
        """Store the body of a request as a file, and describe it."""
        length, data = request.headers.get("content-length", "0"), bytearray()
        if not length.isdecimal() or int(length) > MAX_FILE_SIZE:
            return _respond_problem(TOO_LARGE, 413)
        try:
            async for chunk in request.stream():
                data += chunk
                if len(data) > MAX_FILE_SIZE:
                    return _respond_problem(TOO_LARGE, 413)
        except ClientDisconnect:
            return Response(status_code=400)
        name = request.query_params.get("name", "")
        description = await self._run_in_thread(lambda: self.explorer.add_file(name, bytes(data)))
        return JSONResponse(to_plain(description), headers=_HEADERS)

    def _describe_page(self) -> dict[str, Any]:
        """Return the specification of the page and its initial case."""
        study = None if self.study is None else self.study.describe()
        own = {"axes": maps.describe_axes(), "opening": self.opening, "study": study, "block_page": is_available()}
        return specification() | own

    def _export(self, query: Query) -> Download:
        form = query.fields.get("form", "")
        return Download(form, self.explorer.export(query.texts, form, query.window))

    def _read_case(self, query: Query) -> Case:
        return read_case(query.texts, self.explorer.uploads)

    def _read_grid(self, query: Query) -> maps.MapGrid:
        return maps.read_grid(self._read_case(query), query.others)

    def _stream_map(self, query: Query) -> Stream:
        grid = self._read_grid(query)
        python = {quantity: map_as_python(grid, quantity) for quantity in QUANTITIES}
        return Stream({**maps.describe_map(grid), "python": python}, maps.simulate_grid(grid))

    def _stream_sweep(self, query: Query) -> Stream:
        sweep = periodic.read_sweep(self._read_case(query), query.others)
        return Stream(
            periodic.describe_sweep(sweep) | {"python": sweep_as_python(sweep)}, periodic.simulate_sweep(sweep)
        )

    def _find_sweep_texts(self, query: Query) -> dict[str, str]:
        sweep = periodic.read_sweep(self._read_case(query), query.others)
        state = query.numbers("u", "v") if query.fields.get("u") else None
        return periodic.sweep_point_to_texts(sweep, query.numbers("at", "at")[0], state)

    def _stream_assessment(self, query: Query) -> Stream:
        evaluation = assessment.read_assessment(self._read_case(query), query.others, self.explorer.uploads)
        return Stream(assessment.describe_assessment(evaluation), assessment.simulate_records(evaluation))

    def _require_study(self) -> StudyView:
        if self.study is None:
            raise OptionError("no study is open: start with rocking explore FOLDER")
        return self.study


@cache
def _build_block_page() -> str:
    return build_page(served=True)


def _carries(request: Request, credentials: str) -> bool:
    """Whether the Authorization header of a request contains these credentials."""
    header = request.headers.get("authorization", "")
    return hmac.compare_digest(header.encode(), f"Bearer {credentials}".encode())


def _add_length(data: bytes) -> bytes:
    return struct.pack("<Q", len(data)) + data


def _describe_error(error: RockingError, motion: str) -> dict[str, Any]:
    """Return the message of an error, with the page's names of the fields, and the argument."""
    return {"problem": error.text(lambda name: field_label(name, motion)), "argument": error.argument}


def _respond_problem(problem: str, status: int) -> Response:
    return JSONResponse({"problem": problem, "argument": None}, status, _HEADERS)


async def _respond_invalid(request: Request, error: Exception) -> Response:
    assert isinstance(error, RockingError)
    return JSONResponse(_describe_error(error, request.query_params.get("motion", "")), 422, _HEADERS)


async def _respond_failure(_: Request, error: Exception) -> Response:
    return _respond_problem(f"this could not be computed ({type(error).__name__}); please report it", 500)
