"""Web application: converts requests to calls of the core, and payloads to bytes."""

from __future__ import annotations

import asyncio
import json
import math
import secrets
import struct
from collections.abc import AsyncIterator, Awaitable, Callable, Generator, Mapping
from dataclasses import asdict
from functools import cached_property
from importlib import metadata, resources
from pathlib import Path
from typing import Any, Final, NamedTuple, TypeVar

import anyio
import anyio.to_thread
from starlette.applications import Starlette
from starlette.requests import ClientDisconnect, Request
from starlette.responses import JSONResponse, Response, StreamingResponse
from starlette.routing import Route
from uvicorn.protocols.http.h11_impl import H11Protocol

from rocking.core.tables import plain
from rocking.errors import InvalidOption, RockingError
from rocking.explorer import assessment, maps, periodic, readings
from rocking.explorer.catalogue import entries_of, listing
from rocking.explorer.code import map_as_python, sweep_as_python
from rocking.explorer.core import EXPORTS, Explorer
from rocking.explorer.inputs import Case, read_case
from rocking.explorer.parameters import PARAMETERS, QUANTITIES, field_label, specification
from rocking.explorer.payload import Payload, filled, pack, phrase
from rocking.explorer.studies import StudyView
from rocking.explorer.uploads import LARGEST, TOO_LARGE
from rocking.inputs.quantities import number

T = TypeVar("T")

#: Time until the first request of a connection has come, s.
PATIENCE: Final = 10.0

#: Prefix of the texts of the case that is compared with.
OTHER: Final = "other."

#: Content types of the page's own files.
TYPES: Final = {
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".json": "application/json",
    ".svg": "image/svg+xml",
}

#: Files of the plotting library, in loading order.
LIBRARY: Final = ("bokeh.min.js", "bokeh-api.min.js")

_SENT_WITH_ALL: Final = {
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-resource-policy": "same-origin",
}
_FRESH: Final = {**_SENT_WITH_ALL, "cache-control": "no-store"}
_FOR_GOOD: Final = {**_SENT_WITH_ALL, "cache-control": "private, max-age=31536000, immutable"}


def page_files() -> dict[str, bytes]:
    """Return the page's own files by name."""
    folder = resources.files("rocking.explorer") / "page"
    return {file.name: file.read_bytes() for file in folder.iterdir() if Path(file.name).suffix in {*TYPES, ".html"}}


def library_folder() -> Path:
    """Return the folder of the plotting library in its installed package, without importing the package."""
    return Path(str(metadata.distribution("bokeh").locate_file("bokeh/server/static/js")))


class Query:
    """Query of an address, parsed on access."""

    def __init__(self, given: Mapping[str, str]) -> None:
        self.given = given

    def texts(self, prefix: str = "") -> dict[str, str]:
        """Return the texts of a case."""
        return {name: self.given[prefix + name] for name in PARAMETERS if self.given.get(prefix + name)}

    @cached_property
    def others(self) -> dict[str, str]:
        """Return all texts that do not belong to the case."""
        return {name: value for name, value in self.given.items() if name not in PARAMETERS}

    def number(self, name: str) -> float | None:
        """Return a finite number, or None if it is missing."""
        text = self.given.get(name)
        if not text:
            return None
        value = number(text[:40], name)
        if not math.isfinite(value):
            raise InvalidOption("{} must be a finite number", name, value=value)
        return value

    def numbers(self, first: str, second: str) -> tuple[float, float]:
        """Return two required numbers."""
        found = self.number(first), self.number(second)
        if found[0] is None or found[1] is None:
            raise InvalidOption("{} and {} are needed", first, second)
        return found[0], found[1]

    @property
    def window(self) -> tuple[float, float] | None:
        """Return the ends of a time window, s, or None if they are missing."""
        return self.numbers("from", "to") if self.given.get("from") and self.given.get("to") else None


class Download(NamedTuple):
    """File to save: its form, one of `EXPORTS`, and its content."""

    form: str
    content: bytes


class BoundedProtocol(H11Protocol):
    """A connection that ends unless a whole request comes within some seconds."""

    _timer: asyncio.TimerHandle | None = None

    def connection_made(self, transport: Any) -> None:
        """Wait for the first request."""
        super().connection_made(transport)
        self._timer = self.loop.call_later(PATIENCE, transport.abort)

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop waiting."""
        self._stop()
        super().connection_lost(exc)

    def handle_events(self) -> None:
        """Stop waiting once a request has come; between requests uvicorn has a limit of its own."""
        super().handle_events()
        if self.cycle is not None:
            self._stop()

    def _stop(self) -> None:
        if self._timer is not None:
            self._timer.cancel()


class App:
    """Application; ``opening`` contains the texts of a bare address, ``framed_by`` the pages that may frame it."""

    def __init__(
        self,
        explorer: Explorer,
        opening: Mapping[str, str],
        study: StudyView | None = None,
        framed_by: str = "'none'",
    ) -> None:
        self.explorer = explorer
        self.opening = dict(opening)
        self.study = study
        self.framed_by = framed_by
        self.files = page_files()
        self.html = filled(self.files["index.html"].decode(), json.loads(self.files["texts.json"]))
        self.library = {name: (library_folder() / name).read_bytes() for name in LIBRARY}
        self._threads = anyio.CapacityLimiter(4)  # other computations wait
        self._streams = anyio.CapacityLimiter(2)
        answers: dict[str, Callable[[Query], Any]] = {
            "/api/start": self._start,
            "/api/case": lambda query: explorer.case(query.texts(), query.window),
            "/api/window": self._window,
            "/api/phase": lambda query: readings.phase(explorer, query.texts(), query.numbers("from", "to")),
            "/api/at": lambda query: readings.at(explorer, query.texts(), query.given.get("at", ""), query.window),
            "/api/summary": lambda query: explorer.summary(query.texts()),
            "/api/body": lambda query: explorer.body(query.texts()),
            "/api/code": lambda query: explorer.code(query.texts()),
            "/api/compare": self._compare,
            "/api/export": self._export,
            "/api/map/point": self._point_of_map,
            "/api/map/response": lambda query: readings.thumbnail(explorer, self._point_of_map(query)),
            "/api/orbit": lambda query: periodic.orbit(self._case(query)),
            "/api/sweep/point": self._point_of_sweep,
            "/api/sweep/code": lambda query: {"python": sweep_as_python(self._sweep(query))},
            "/api/list": lambda query: listing(explorer.uploads, entries_of(query.given.get("answers", ""))),
            "/api/records/{key}": self._record,
            "/api/study": lambda query: self._study().slice(query.others),
            "/api/study/point": self._point_of_study,
            "/api/study/response": lambda query: readings.thumbnail(explorer, self._point_of_study(query)),
        }
        streams = {"/api/map": self._map, "/api/sweep": self._swept, "/api/assessment": self._assessment}
        self.asgi = Starlette(
            routes=[
                Route("/", self.page),
                Route("/page/{name}", self.file),
                Route("/library/{name}", self.script),
                *(Route(path, self._answering(work)) for path, work in answers.items()),
                *(Route(path, self._streaming(begin)) for path, begin in streams.items()),
                Route("/api/records", self._receiving(explorer.take_record), methods=["POST"]),
                Route("/api/meshes", self._receiving(explorer.take_mesh), methods=["POST"]),
                Route(
                    "/api/records/{key}",
                    self._answering(lambda query: explorer.forget(query.given["key"])),
                    methods=["DELETE"],
                ),
            ],
            exception_handlers={RockingError: _refusal, Exception: _failure},
        )
        self.asgi.router.redirect_slashes = False

    async def page(self, _: Request) -> Response:
        """Return the page, with a new nonce."""
        nonce = secrets.token_urlsafe(16)
        policy = (
            "default-src 'none'; script-src 'self'; connect-src 'self'; "
            f"style-src 'self' 'nonce-{nonce}'; img-src 'self' data:; base-uri 'none'; form-action 'none'; "
            f"frame-ancestors {self.framed_by}"
        )
        html = self.html.replace("NONCE", nonce)
        return Response(html, media_type="text/html", headers={**_FRESH, "content-security-policy": policy})

    async def file(self, request: Request) -> Response:
        """Return one of the page's own files."""
        return _static(self.files, request.path_params["name"], {**_SENT_WITH_ALL, "cache-control": "no-cache"})

    async def script(self, request: Request) -> Response:
        """Return a file of the plotting library."""
        return _static(self.library, request.path_params["name"], _FOR_GOOD)

    def _answering(self, work: Callable[[Query], Any]) -> Callable[[Request], Awaitable[Response]]:
        """Return a handler that responds with a payload, a file, or plain values, computed in a thread."""

        async def answer(request: Request) -> Response:
            query = Query({**request.query_params, **request.path_params})
            found = await self._in_thread(lambda: work(query))
            if isinstance(found, Payload):
                return Response(pack(found), media_type="application/octet-stream", headers=_FRESH)
            if isinstance(found, Download):
                headers = {**_FRESH, "content-disposition": f"attachment; filename=rocking-response.{found.form}"}
                return Response(found.content, media_type=EXPORTS[found.form], headers=headers)
            return JSONResponse(plain(found), headers=_FRESH)

        return answer

    async def _in_thread(self, work: Callable[[], T]) -> T:
        return await anyio.to_thread.run_sync(work, limiter=self._threads)

    def _start(self, _: Query) -> dict[str, Any]:
        """Return the specification of the page and its initial case."""
        return {
            **specification(),
            "axes": [asdict(axis) | {"label": phrase(f"axis.{axis.name}")} for axis in maps.AXES.values()],
            "opening": self.opening,
            "study": None if self.study is None else self.study.describe(),
        }

    def _window(self, query: Query) -> Payload:
        """Return the arrays of a window."""
        points, ground = int(query.number("points") or 3000), query.given.get("ground") == "1"
        return self.explorer.window(query.texts(), query.numbers("from", "to"), ground=ground, points=points)

    def _compare(self, query: Query) -> Payload:
        """Return two cases in one window."""
        whole = query.given.get("compare") == "case"
        return self.explorer.compare(query.texts(), query.texts(OTHER), query.window, whole=whole)

    def _export(self, query: Query) -> Download:
        """Return a figure or a table of a case as a file."""
        form = query.given.get("form", "")
        return Download(form, self.explorer.export(query.texts(), form, query.window))

    def _record(self, query: Query) -> dict[str, Any]:
        """Describe a stored file, read with the step and the units of the query."""
        units = query.given.get("units") or None
        return self.explorer.uploads.contents(query.given["key"], query.number("dt"), units)

    def _case(self, query: Query) -> Case:
        return read_case(query.texts(), self.explorer.uploads)

    def _grid(self, query: Query) -> maps.MapGrid:
        return maps.grid_of(self._case(query), query.others)

    def _sweep(self, query: Query) -> periodic.Sweep:
        return periodic.sweep_of(self._case(query), query.others)

    def _point_of_map(self, query: Query) -> dict[str, str]:
        return maps.texts_at(self._grid(query), *query.numbers("at_x", "at_y"))

    def _point_of_sweep(self, query: Query) -> dict[str, str]:
        """Return the texts of the case at a value of the parameter, released from a state, if any."""
        value, _ = query.numbers("at", "at")
        return periodic.texts_at(self._sweep(query), value, query.numbers("u", "v") if query.given.get("u") else None)

    def _study(self) -> StudyView:
        if self.study is None:
            raise InvalidOption("no study is open: start with rocking explore FOLDER")
        return self.study

    def _point_of_study(self, query: Query) -> dict[str, str]:
        return self._study().texts_at(query.others, self.explorer.uploads)

    def _map(self, query: Query) -> _Stream:
        grid = self._grid(query)
        python = {quantity: map_as_python(grid, quantity) for quantity in QUANTITIES}
        return _Stream({**maps.described(grid), "python": python}, maps.parts(grid), _part_of_map)

    def _swept(self, query: Query) -> _Stream:
        sweep = self._sweep(query)
        about = {**periodic.described(sweep), "python": sweep_as_python(sweep)}
        return _Stream(about, periodic.parts(sweep), lambda part: pack(periodic.part_payload(sweep, part)))

    def _assessment(self, query: Query) -> _Stream:
        found = assessment.assessment_of(self._case(query), query.others, self.explorer.uploads)
        return _Stream(assessment.described(found), assessment.parts(found), pack)

    def _streaming(self, begin: Callable[[Query], _Stream]) -> Callable[[Request], Awaitable[Response]]:
        """Return a handler that responds part by part, from coarse to fine: a description, then the parts."""

        async def answer(request: Request) -> Response:
            stream = await self._in_thread(lambda: begin(Query(request.query_params)))
            parts = self._parts(stream, request.query_params.get("motion", ""))
            return StreamingResponse(parts, media_type="application/octet-stream", headers=_FRESH)

        return answer

    async def _parts(self, stream: _Stream, motion: str) -> AsyncIterator[bytes]:
        """Yield the parts of a stream as bytes; the computation stops when the reader disconnects."""
        yield _framed(json.dumps({**stream.about, "problem": None}).encode())
        async with self._streams:
            try:
                while (part := await anyio.to_thread.run_sync(_next, stream, motion)) is not None:
                    yield part
            finally:
                with anyio.CancelScope(shield=True):
                    await anyio.to_thread.run_sync(stream.parts.close)

    def _receiving(self, take: Callable[[str, bytes], dict[str, Any]]) -> Callable[[Request], Awaitable[Response]]:
        """Return a handler that accepts a file as the raw body and describes it."""

        async def receive(request: Request) -> Response:
            stated = request.headers.get("content-length", "0")
            if not stated.isdecimal() or int(stated) > LARGEST:
                return _too_large()
            data = bytearray()
            try:
                async for chunk in request.stream():
                    data += chunk
                    if len(data) > LARGEST:
                        return _too_large()
            except ClientDisconnect:
                return Response(status_code=400)
            name = request.query_params.get("name", "")
            return JSONResponse(await self._in_thread(lambda: take(name, bytes(data))), headers=_FRESH)

        return receive


class _Stream(NamedTuple):
    """Response in parts: description, parts, and the encoder of a part."""

    about: dict[str, Any]
    parts: Generator[Any]
    written: Callable[[Any], bytes]


def _next(stream: _Stream, motion: str) -> bytes | None:
    """Return the next part or an error as bytes, or None at the end."""
    try:
        part = next(stream.parts, None)
    except RockingError as error:
        return _framed(json.dumps(_problem(error, motion)).encode())
    return None if part is None else _framed(stream.written(part))


def _part_of_map(part: maps.Part) -> bytes:
    head = struct.pack("<II", part.stride, len(part.points))
    return head + part.points.astype("<u4").tobytes() + part.values.astype("<f4").tobytes()


def _framed(data: bytes) -> bytes:
    """Return data behind their length, padded to a multiple of 4."""
    padded = data + b" " * (-len(data) % 4)
    return struct.pack("<I", len(padded)) + padded


def _static(files: Mapping[str, bytes], name: str, headers: Mapping[str, str]) -> Response:
    suffix = name[name.rfind(".") :]
    if name not in files or suffix not in TYPES:
        return Response("there is no such file", 404, headers=dict(_FRESH), media_type="text/plain")
    return Response(files[name], media_type=TYPES[suffix], headers=dict(headers))


def _problem(error: RockingError, motion: str) -> dict[str, str | None]:
    """Return the message of an error, with the page's names of the fields, and the argument."""
    return {"problem": error.text(lambda name: field_label(name, motion)), "argument": error.argument}


async def _refusal(request: Request, error: Exception) -> Response:
    assert isinstance(error, RockingError)
    return JSONResponse(_problem(error, request.query_params.get("motion", "")), 422, headers=_FRESH)


def _too_large() -> Response:
    return JSONResponse({"problem": TOO_LARGE, "argument": None}, 413, headers={**_FRESH, "connection": "close"})


async def _failure(_: Request, error: Exception) -> Response:
    problem = f"this could not be computed ({type(error).__name__}); please report it"
    return JSONResponse({"problem": problem, "argument": None}, 500, headers=_FRESH)
