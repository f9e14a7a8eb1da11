"""Web application: converts requests to calls of the core, and payloads to bytes."""

from __future__ import annotations

import asyncio
import json
import math
import secrets
import struct
from collections.abc import AsyncIterator, Awaitable, Callable, Generator, Mapping
from dataclasses import asdict
from functools import cache, cached_property
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

from rocking.core.tables import to_plain
from rocking.errors import OptionError, RockingError
from rocking.explorer import assessment, maps, periodic, readings
from rocking.explorer.catalogue import list_records, read_entries
from rocking.explorer.code import map_as_python, sweep_as_python
from rocking.explorer.core import EXPORTS, Explorer
from rocking.explorer.inputs import Case, read_case
from rocking.explorer.parameters import PARAMETERS, QUANTITIES, field_label, specification
from rocking.explorer.payload import Payload, fill_page, pack, phrase
from rocking.explorer.standalone import build_page, is_available
from rocking.explorer.studies import StudyView
from rocking.explorer.uploads import MAX_FILE_SIZE, TOO_LARGE_MESSAGE
from rocking.inputs.quantities import read_number

T = TypeVar("T")

#: Longest time from a connection to its first request, s.
REQUEST_TIMEOUT: Final = 10.0

#: Prefix of the texts of the second case of a comparison.
COMPARED_PREFIX: Final = "other."

#: Content types of the page's own files.
CONTENT_TYPES: Final = {
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".json": "application/json",
    ".svg": "image/svg+xml",
}

#: Files of the plotting library, in loading order.
LIBRARY_FILES: Final = ("bokeh.min.js", "bokeh-api.min.js")

_COMMON_HEADERS: Final = {
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-resource-policy": "same-origin",
}
_NO_STORE: Final = {**_COMMON_HEADERS, "cache-control": "no-store"}
_IMMUTABLE: Final = {**_COMMON_HEADERS, "cache-control": "private, max-age=31536000, immutable"}


def page_files() -> dict[str, bytes]:
    """Return the page's own files by name."""
    folder = resources.files("rocking.explorer") / "page"
    return {
        file.name: file.read_bytes() for file in folder.iterdir() if Path(file.name).suffix in {*CONTENT_TYPES, ".html"}
    }


def library_folder() -> Path:
    """Return the folder of the plotting library in its installed package, without importing the package."""
    return Path(str(metadata.distribution("bokeh").locate_file("bokeh/server/static/js")))


class Query:
    """Query of an address, parsed on access."""

    def __init__(self, fields: Mapping[str, str]) -> None:
        self.fields = fields

    def texts(self, prefix: str = "") -> dict[str, str]:
        """Return the texts of a case."""
        return {name: self.fields[prefix + name] for name in PARAMETERS if self.fields.get(prefix + name)}

    @cached_property
    def others(self) -> dict[str, str]:
        """Return all texts that do not belong to the case."""
        return {name: value for name, value in self.fields.items() if name not in PARAMETERS}

    def number(self, name: str) -> float | None:
        """Return a finite number, or None if it is missing."""
        text = self.fields.get(name)
        if not text:
            return None
        value = read_number(text[:40], name)
        if not math.isfinite(value):
            raise OptionError("{} must be a finite number", name, value=value)
        return value

    def numbers(self, first: str, second: str) -> tuple[float, float]:
        """Return two required numbers."""
        pair = self.number(first), self.number(second)
        if pair[0] is None or pair[1] is None:
            raise OptionError("{} and {} are needed", first, second)
        return pair[0], pair[1]

    @property
    def window(self) -> tuple[float, float] | None:
        """Return the ends of a time window, s, or None if they are missing."""
        return self.numbers("from", "to") if self.fields.get("from") and self.fields.get("to") else None


class Download(NamedTuple):
    """File to save: its form, one of `EXPORTS`, and its content."""

    form: str
    content: bytes


class BoundedProtocol(H11Protocol):
    """Connection that is closed unless a complete request arrives within `REQUEST_TIMEOUT`."""

    _timer: asyncio.TimerHandle | None = None

    def connection_made(self, transport: Any) -> None:
        """Wait for the first request."""
        super().connection_made(transport)
        self._timer = self.loop.call_later(REQUEST_TIMEOUT, transport.abort)

    def connection_lost(self, exc: Exception | None) -> None:
        """Stop waiting."""
        self._stop()
        super().connection_lost(exc)

    def handle_events(self) -> None:
        """Stop waiting once a request has arrived; uvicorn limits the time between requests."""
        super().handle_events()
        if self.cycle is not None:
            self._stop()

    def _stop(self) -> None:
        if self._timer is not None:
            self._timer.cancel()


class App:
    """Application; ``opening`` contains the texts of the initial case, ``framed_by`` the pages that may frame it."""

    def __init__(
        self, explorer: Explorer, opening: Mapping[str, str], study: StudyView | None = None, framed_by: str = "'none'"
    ) -> None:
        self.explorer = explorer
        self.opening = dict(opening)
        self.study = study
        self.framed_by = framed_by
        self.files = page_files()
        self.html = fill_page(self.files["index.html"].decode(), json.loads(self.files["texts.json"]))
        self.library = {name: (library_folder() / name).read_bytes() for name in LIBRARY_FILES}
        self._threads = anyio.CapacityLimiter(4)  # other computations wait
        self._streams = anyio.CapacityLimiter(2)
        computations: dict[str, Callable[[Query], Any]] = {
            "/api/start": self._describe_page,
            "/api/case": lambda query: explorer.case(query.texts(), query.window),
            "/api/window": self._compute_window,
            "/api/phase": lambda query: readings.sample_phase(explorer, query.texts(), query.numbers("from", "to")),
            "/api/at": lambda query: readings.find_state(
                explorer, query.texts(), query.fields.get("at", ""), query.window
            ),
            "/api/summary": lambda query: explorer.summary(query.texts()),
            "/api/body": lambda query: explorer.body(query.texts()),
            "/api/code": lambda query: explorer.code(query.texts()),
            "/api/compare": self._compare,
            "/api/export": self._export,
            "/api/map/point": self._find_map_texts,
            "/api/map/response": lambda query: readings.create_thumbnail(explorer, self._find_map_texts(query)),
            "/api/orbit": lambda query: periodic.describe_orbit(self._read_case(query)),
            "/api/sweep/point": self._find_sweep_texts,
            "/api/sweep/code": lambda query: {"python": sweep_as_python(self._read_sweep(query))},
            "/api/list": lambda query: list_records(explorer.uploads, read_entries(query.fields.get("answers", ""))),
            "/api/records/{key}": self._describe_record,
            "/api/study": lambda query: self._require_study().slice(query.others),
            "/api/study/point": self._find_study_texts,
            "/api/study/response": lambda query: readings.create_thumbnail(explorer, self._find_study_texts(query)),
        }
        streams = {
            "/api/map": self._stream_map,
            "/api/sweep": self._stream_sweep,
            "/api/assessment": self._stream_assessment,
        }
        self.asgi = Starlette(
            routes=[
                Route("/", self.send_page),
                Route("/block", self.send_block),
                Route("/page/{name}", self.send_file),
                Route("/library/{name}", self.send_script),
                *(Route(path, self._create_handler(compute)) for path, compute in computations.items()),
                *(Route(path, self._create_stream_handler(start)) for path, start in streams.items()),
                Route("/api/records", self._create_upload_handler(explorer.add_record), methods=["POST"]),
                Route("/api/meshes", self._create_upload_handler(explorer.add_mesh), methods=["POST"]),
                Route(
                    "/api/records/{key}",
                    self._create_handler(lambda query: explorer.remove(query.fields["key"])),
                    methods=["DELETE"],
                ),
            ],
            exception_handlers={RockingError: _respond_invalid, Exception: _respond_failure},
        )
        self.asgi.router.redirect_slashes = False

    async def send_page(self, _: Request) -> Response:
        """Return the page, with a new nonce."""
        nonce = secrets.token_urlsafe(16)
        policy = (
            "default-src 'none'; script-src 'self'; connect-src 'self'; "
            f"style-src 'self' 'nonce-{nonce}'; img-src 'self' data:; base-uri 'none'; form-action 'none'; "
            f"frame-ancestors {self.framed_by}"
        )
        html = self.html.replace("NONCE", nonce)
        return Response(html, media_type="text/html", headers={**_NO_STORE, "content-security-policy": policy})

    async def send_block(self, _: Request) -> Response:
        """Return the standalone page, which leads to this one."""
        html = await self._run_in_thread(_build_block_page)
        headers = {**_NO_STORE, "content-security-policy": f"frame-ancestors {self.framed_by}"}
        return Response(html, media_type="text/html", headers=headers)

    async def send_file(self, request: Request) -> Response:
        """Return one of the page's own files."""
        return _send_static(self.files, request.path_params["name"], {**_COMMON_HEADERS, "cache-control": "no-cache"})

    async def send_script(self, request: Request) -> Response:
        """Return a file of the plotting library."""
        return _send_static(self.library, request.path_params["name"], _IMMUTABLE)

    def _create_handler(self, compute: Callable[[Query], Any]) -> Callable[[Request], Awaitable[Response]]:
        """Return a handler that responds with a payload, a file, or plain values, computed in a thread."""

        async def respond(request: Request) -> Response:
            query = Query({**request.query_params, **request.path_params})
            result = await self._run_in_thread(lambda: compute(query))
            if isinstance(result, Payload):
                return Response(pack(result), media_type="application/octet-stream", headers=_NO_STORE)
            if isinstance(result, Download):
                headers = {**_NO_STORE, "content-disposition": f"attachment; filename=rocking-response.{result.form}"}
                return Response(result.content, media_type=EXPORTS[result.form], headers=headers)
            return JSONResponse(to_plain(result), headers=_NO_STORE)

        return respond

    async def _run_in_thread(self, compute: Callable[[], T]) -> T:
        return await anyio.to_thread.run_sync(compute, limiter=self._threads)

    def _describe_page(self, _: Query) -> dict[str, Any]:
        """Return the specification of the page and its initial case."""
        return {
            **specification(),
            "axes": [asdict(axis) | {"label": phrase(f"axis.{axis.name}")} for axis in maps.AXES.values()],
            "opening": self.opening,
            "block_page": is_available(),
            "study": None if self.study is None else self.study.describe(),
        }

    def _compute_window(self, query: Query) -> Payload:
        """Return the arrays of a window."""
        points, ground = int(query.number("points") or 3000), query.fields.get("ground") == "1"
        return self.explorer.window(query.texts(), query.numbers("from", "to"), ground=ground, points=points)

    def _compare(self, query: Query) -> Payload:
        """Return two cases in one window."""
        complete = query.fields.get("compare") == "case"
        return self.explorer.compare(query.texts(), query.texts(COMPARED_PREFIX), query.window, complete=complete)

    def _export(self, query: Query) -> Download:
        """Return a figure or a table of a case as a file."""
        form = query.fields.get("form", "")
        return Download(form, self.explorer.export(query.texts(), form, query.window))

    def _describe_record(self, query: Query) -> dict[str, Any]:
        """Describe a stored file, read with the step and the units of the query."""
        units = query.fields.get("units") or None
        return self.explorer.uploads.describe_file(query.fields["key"], query.number("dt"), units)

    def _read_case(self, query: Query) -> Case:
        return read_case(query.texts(), self.explorer.uploads)

    def _read_grid(self, query: Query) -> maps.MapGrid:
        return maps.read_grid(self._read_case(query), query.others)

    def _read_sweep(self, query: Query) -> periodic.Sweep:
        return periodic.read_sweep(self._read_case(query), query.others)

    def _find_map_texts(self, query: Query) -> dict[str, str]:
        return maps.map_point_to_texts(self._read_grid(query), *query.numbers("at_x", "at_y"))

    def _find_sweep_texts(self, query: Query) -> dict[str, str]:
        """Return the texts of the case at a value of the parameter, released from a state, if any."""
        value, _ = query.numbers("at", "at")
        return periodic.sweep_point_to_texts(
            self._read_sweep(query), value, query.numbers("u", "v") if query.fields.get("u") else None
        )

    def _require_study(self) -> StudyView:
        if self.study is None:
            raise OptionError("no study is open: start with rocking explore FOLDER")
        return self.study

    def _find_study_texts(self, query: Query) -> dict[str, str]:
        return self._require_study().point_to_texts(query.others, self.explorer.uploads)

    def _stream_map(self, query: Query) -> _Stream:
        grid = self._read_grid(query)
        python = {quantity: map_as_python(grid, quantity) for quantity in QUANTITIES}
        return _Stream({**maps.describe_map(grid), "python": python}, maps.simulate_grid(grid), _pack_map_part)

    def _stream_sweep(self, query: Query) -> _Stream:
        sweep = self._read_sweep(query)
        header = {**periodic.describe_sweep(sweep), "python": sweep_as_python(sweep)}
        return _Stream(header, periodic.simulate_sweep(sweep), lambda part: pack(periodic.pack_sweep_part(sweep, part)))

    def _stream_assessment(self, query: Query) -> _Stream:
        evaluation = assessment.read_assessment(self._read_case(query), query.others, self.explorer.uploads)
        return _Stream(assessment.describe_assessment(evaluation), assessment.simulate_records(evaluation), pack)

    def _create_stream_handler(self, start: Callable[[Query], _Stream]) -> Callable[[Request], Awaitable[Response]]:
        """Return a handler that responds part by part, from coarse to fine: a description, then the parts."""

        async def respond(request: Request) -> Response:
            stream = await self._run_in_thread(lambda: start(Query(request.query_params)))
            parts = self._encode_parts(stream, request.query_params.get("motion", ""))
            return StreamingResponse(parts, media_type="application/octet-stream", headers=_NO_STORE)

        return respond

    async def _encode_parts(self, stream: _Stream, motion: str) -> AsyncIterator[bytes]:
        """Yield the parts of a stream as bytes; the computation stops when the reader disconnects."""
        yield _add_length(json.dumps({**stream.description, "problem": None}).encode())
        async with self._streams:
            try:
                while (part := await anyio.to_thread.run_sync(_encode_next, stream, motion)) is not None:
                    yield part
            finally:
                with anyio.CancelScope(shield=True):
                    await anyio.to_thread.run_sync(stream.parts.close)

    def _create_upload_handler(
        self, store: Callable[[str, bytes], dict[str, Any]]
    ) -> Callable[[Request], Awaitable[Response]]:
        """Return a handler that accepts a file as the raw body and describes it."""

        async def receive(request: Request) -> Response:
            content_length = request.headers.get("content-length", "0")
            if not content_length.isdecimal() or int(content_length) > MAX_FILE_SIZE:
                return _respond_too_large()
            data = bytearray()
            try:
                async for chunk in request.stream():
                    data += chunk
                    if len(data) > MAX_FILE_SIZE:
                        return _respond_too_large()
            except ClientDisconnect:
                return Response(status_code=400)
            name = request.query_params.get("name", "")
            return JSONResponse(await self._run_in_thread(lambda: store(name, bytes(data))), headers=_NO_STORE)

        return receive


@cache
def _build_block_page() -> str:
    return build_page(served=True)


class _Stream(NamedTuple):
    """Response that is sent in parts."""

    description: dict[str, Any]  # first part, as JSON
    parts: Generator[Any]
    encode: Callable[[Any], bytes]  # of a part


def _encode_next(stream: _Stream, motion: str) -> bytes | None:
    """Return the next part or an error as bytes, or None at the end."""
    try:
        part = next(stream.parts, None)
    except RockingError as error:
        return _add_length(json.dumps(_describe_error(error, motion)).encode())
    return None if part is None else _add_length(stream.encode(part))


def _pack_map_part(part: maps.MapPart) -> bytes:
    header = struct.pack("<II", part.stride, len(part.points))
    return header + part.points.astype("<u4").tobytes() + part.values.astype("<f4").tobytes()


def _add_length(data: bytes) -> bytes:
    """Return data behind their length, padded to a multiple of 4."""
    padded = data + b" " * (-len(data) % 4)
    return struct.pack("<I", len(padded)) + padded


def _send_static(files: Mapping[str, bytes], name: str, headers: Mapping[str, str]) -> Response:
    suffix = name[name.rfind(".") :]
    if name not in files or suffix not in CONTENT_TYPES:
        return Response("there is no such file", 404, headers=dict(_NO_STORE), media_type="text/plain")
    return Response(files[name], media_type=CONTENT_TYPES[suffix], headers=dict(headers))


def _describe_error(error: RockingError, motion: str) -> dict[str, str | None]:
    """Return the message of an error, with the page's names of the fields, and the argument."""
    return {"problem": error.text(lambda name: field_label(name, motion)), "argument": error.argument}


async def _respond_invalid(request: Request, error: Exception) -> Response:
    assert isinstance(error, RockingError)
    return JSONResponse(_describe_error(error, request.query_params.get("motion", "")), 422, headers=_NO_STORE)


def _respond_too_large() -> Response:
    return JSONResponse(
        {"problem": TOO_LARGE_MESSAGE, "argument": None}, 413, headers={**_NO_STORE, "connection": "close"}
    )


async def _respond_failure(_: Request, error: Exception) -> Response:
    problem = f"this could not be computed ({type(error).__name__}); please report it"
    return JSONResponse({"problem": problem, "argument": None}, 500, headers=_NO_STORE)
