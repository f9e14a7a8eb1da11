"""The application: requests to calls of the core, payloads to bytes. It knows no mechanics."""

from __future__ import annotations

import asyncio
import json
import math
import os
import secrets
import struct
import sys
import threading
from collections.abc import AsyncIterator, Awaitable, Callable, Generator, Iterator, Mapping
from concurrent.futures import Executor, ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import asdict
from functools import cached_property
from importlib import metadata, resources, util
from pathlib import Path
from typing import Any, Final, NamedTuple, TypeVar
from urllib.parse import quote

import anyio
import anyio.to_thread
from starlette.applications import Starlette
from starlette.requests import ClientDisconnect, Request
from starlette.responses import JSONResponse, Response, StreamingResponse
from starlette.routing import Route

from rocking.core.tables import plain
from rocking.errors import InvalidOption, RockingError
from rocking.explorer import assessment, maps, periodic, readings
from rocking.explorer.catalogue import entries_of, listing
from rocking.explorer.code import map_as_code, sweep_as_code
from rocking.explorer.core import EXPORTS, Explorer
from rocking.explorer.inputs import Case, read_case, tracks
from rocking.explorer.parameters import PARAMETERS, field_label, specification
from rocking.explorer.payload import Payload, pack
from rocking.explorer.phrases import ENGLISH, file_name, filled, phrase, preferred
from rocking.explorer.studies import StudyView
from rocking.explorer.uploads import LARGEST
from rocking.inputs.quantities import number

T = TypeVar("T")
_Naming = Callable[[str], str]

#: Prefix of the texts of the case that is compared with.
OTHER: Final = "other."

#: Types of the page's own files.
TYPES: Final = {
    ".css": "text/css; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".json": "application/json",
    ".svg": "image/svg+xml",
}

#: Files of the plotting library, in the order in which they are loaded.
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
    """Return where the plotting library lies in its installed package, without importing that."""
    version = metadata.version("bokeh")
    if version.split(".")[0] != "3":
        raise InvalidOption(f"the explorer needs bokeh 3.9 or a later 3, not {version}: pip install 'bokeh>=3.9,<4'")
    found = util.find_spec("bokeh")
    places = found.submodule_search_locations if found else None
    folder = Path(next(iter(places or ["bokeh"]))) / "server" / "static" / "js"
    if not all((folder / name).is_file() for name in LIBRARY):
        raise InvalidOption(f"bokeh {version} is not installed completely: install it again")
    return folder


class Query:
    """What an address says, read when it is asked for."""

    def __init__(self, given: Mapping[str, str]) -> None:
        self.given = given

    def texts(self, prefix: str = "") -> dict[str, str]:
        """Texts of a case."""
        return {name: self.given[prefix + name] for name in PARAMETERS if self.given.get(prefix + name)}

    @cached_property
    def others(self) -> dict[str, str]:
        """All that does not belong to the case."""
        return {name: value for name, value in self.given.items() if name not in PARAMETERS}

    @property
    def compared(self) -> tuple[dict[str, str], dict[str, str]]:
        """Texts of two cases, or of one and what the other has in their place."""
        return self.texts(), self.texts(OTHER)

    @property
    def comparison(self) -> dict[str, Any]:
        """How two cases are compared: which moments are laid over each other, and whether the other is a whole case."""
        return {"align": self.given.get("align") or "start", "whole": self.given.get("compare") == "case"}

    def number(self, name: str) -> float | None:
        """Return a finite number; None where it is not given."""
        text = self.given.get(name)
        if not text:
            return None
        value = number(text[:40], name)
        if not math.isfinite(value):
            raise InvalidOption("{} must be a finite number", name, value=value)
        return value

    def numbers(self, first: str, second: str) -> tuple[float, float]:
        """Return two numbers that are needed."""
        found = self.number(first), self.number(second)
        if found[0] is None or found[1] is None:
            raise InvalidOption("{} and {} are needed", first, second)
        return found[0], found[1]

    @property
    def window(self) -> tuple[float, float] | None:
        """Ends of a stretch of time, s; None where they are not given."""
        return self.numbers("from", "to") if self.given.get("from") and self.given.get("to") else None


class App:
    """The explorer's application; ``opening`` are a bare address's texts, ``framed_by`` pages that may frame it."""

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
        self._pages: dict[str, str] = {}
        self.library = {name: (library_folder() / name).read_bytes() for name in LIBRARY}
        self._threads = anyio.CapacityLimiter(4)  # the other computations wait
        self._maps = anyio.CapacityLimiter(2)
        answers: dict[str, Callable[[Query], Payload | Any]] = {
            "/api/start": self._start,
            "/api/case": lambda query: explorer.case(query.texts(), query.window),
            "/api/window": self._window,
            "/api/phase": lambda query: readings.phase(explorer, query.texts(), query.numbers("from", "to")),
            "/api/at": lambda query: readings.at(explorer, query.texts(), query.given.get("at", ""), query.window),
            "/api/summary": lambda query: explorer.summary(query.texts()),
            "/api/body": lambda query: explorer.body(query.texts()),
            "/api/code": lambda query: explorer.code(query.texts()),
            "/api/tracks": lambda query: tracks(query.texts()),
            "/api/compare": lambda query: explorer.compare(*query.compared, query.window, **query.comparison),
            "/api/map/point": lambda query: maps.texts_at(self._grid(query), *query.numbers("at_x", "at_y")),
            "/api/map/response": lambda query: readings.thumbnail(
                explorer, maps.texts_at(self._grid(query), *query.numbers("at_x", "at_y"))
            ),
            "/api/orbit": lambda query: periodic.orbit(self._case(query)),
            "/api/sweep/point": self._point_of_sweep,
            "/api/sweep/code": lambda query: sweep_as_code(self._sweep(query)),
            "/api/list": lambda query: listing(explorer.uploads, entries_of(query.given.get("answers", ""))),
            "/api/study": lambda query: self._study().slice(query.others),
            "/api/study/point": lambda query: self._study().texts_at(query.others, explorer.uploads),
            "/api/study/response": lambda query: readings.thumbnail(
                explorer, self._study().texts_at(query.others, explorer.uploads)
            ),
        }
        self.asgi = Starlette(
            routes=[
                Route("/", self.page),
                Route("/page/{name}", self.file),
                Route("/library/{name}", self.script),
                *(Route(path, self._answering(work)) for path, work in answers.items()),
                Route("/api/map", self.map),
                Route("/api/sweep", self.sweep),
                Route("/api/assessment", self.assessment),
                Route("/api/export", self.export),
                Route("/api/compare/table", self.compared),
                Route("/api/records", self._receiving(explorer.take_record), methods=["POST"]),
                Route("/api/meshes", self._receiving(explorer.take_mesh), methods=["POST"]),
                Route("/api/records/{key}", self.record),
                Route("/api/records/{key}", self.forget, methods=["DELETE"]),
            ],
            exception_handlers={RockingError: self._refusal, Exception: _failure},
        )
        self.asgi.router.redirect_slashes = False

    async def page(self, request: Request) -> Response:
        """Return the page in the language of the browser, with a nonce of its own."""
        nonce = secrets.token_urlsafe(16)
        policy = (
            "default-src 'none'; script-src 'self'; connect-src 'self'; "
            f"style-src 'self' 'nonce-{nonce}'; img-src 'self' data:; base-uri 'none'; form-action 'none'; "
            f"frame-ancestors {self.framed_by}"
        )
        html = self._page(self._language(request)).replace("NONCE", nonce)
        return Response(html, media_type="text/html", headers={**_FRESH, "content-security-policy": policy})

    async def file(self, request: Request) -> Response:
        """Return one of the page's own files, in the language of the browser where it has texts."""
        name = request.path_params["name"]
        there = file_name(name, self._language(request))
        return _static(
            self.files, there if there in self.files else name, {**_SENT_WITH_ALL, "cache-control": "no-cache"}
        )

    def _language(self, request: Request) -> str:
        return preferred(request.headers.get("accept-language", ""), self.files)

    def _texts(self, language: str) -> dict[str, Any]:
        """Return the texts in a language, in English where they are not translated yet."""
        found: dict[str, Any] = json.loads(self.files["texts.json"])
        return found if language == ENGLISH else found | json.loads(self.files[file_name("texts.json", language)])

    def _naming(self, request: Request) -> _Naming:
        """Return what calls an argument as the page does: the label of its field, under the motion of the request."""
        motion, texts = request.query_params.get("motion", ""), self._texts(self._language(request))
        return lambda name: field_label(name, motion, texts)

    async def _refusal(self, request: Request, error: Exception) -> Response:
        assert isinstance(error, RockingError)
        return JSONResponse(_problem(error, self._naming(request)), 422, headers=_FRESH)

    def _page(self, language: str) -> str:
        if language not in self._pages:
            self._pages[language] = filled(self.files["index.html"].decode(), language, self._texts(language))
        return self._pages[language]

    async def script(self, request: Request) -> Response:
        """Return a file of the plotting library."""
        return _static(self.library, request.path_params["name"], _FOR_GOOD)

    def _answering(self, work: Callable[[Query], Payload | Any]) -> Callable[[Request], Awaitable[Response]]:
        """Return what answers a request with a payload, or with plain values, made in a thread."""

        async def answer(request: Request) -> Response:
            found = await anyio.to_thread.run_sync(work, Query(request.query_params), limiter=self._threads)
            if isinstance(found, Payload):
                return Response(pack(found), media_type="application/octet-stream", headers=_FRESH)
            return JSONResponse(plain(found), headers=_FRESH)

        return answer

    async def _in_thread(self, work: Callable[[], T]) -> T:
        return await anyio.to_thread.run_sync(work, limiter=self._threads)

    def _start(self, _: Query) -> dict[str, Any]:
        """Return the specification of the page and what it opens with."""
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

    def _case(self, query: Query) -> Case:
        return read_case(query.texts(), self.explorer.uploads)

    def _grid(self, query: Query) -> maps.MapGrid:
        return maps.grid_of(self._case(query), query.others)

    def _sweep(self, query: Query) -> periodic.Sweep:
        return periodic.sweep_of(self._case(query), query.others)

    def _point_of_sweep(self, query: Query) -> dict[str, str]:
        """Return the texts of the case at a value of the parameter, released from a state where one is given."""
        value, _ = query.numbers("at", "at")
        return periodic.texts_at(self._sweep(query), value, query.numbers("u", "v") if query.given.get("u") else None)

    def _study(self) -> StudyView:
        if self.study is None:
            raise InvalidOption("no study is open: start with rocking explore FOLDER")
        return self.study

    async def map(self, request: Request) -> Response:
        """Stream a map, coarse to fine: what it shows, then parts of it."""

        def begun(query: Query) -> _Stream:
            grid = self._grid(query)
            return _Stream({**maps.described(grid), **map_as_code(grid)}, maps.parts(grid), _part_of_map)

        return await self._streamed(request, begun)

    async def sweep(self, request: Request) -> Response:
        """Stream a sweep under periodic motion, coarse to fine: what is swept, then parts of it, each a payload."""

        def begun(query: Query) -> _Stream:
            sweep = self._sweep(query)
            about = {**periodic.described(sweep), **sweep_as_code(sweep)}
            return _Stream(about, periodic.parts(sweep), lambda part: pack(periodic.part_payload(sweep, part)))

        return await self._streamed(request, begun)

    async def assessment(self, request: Request) -> Response:
        """Stream an assessment: what it is of, then what each record adds to it, each a payload."""

        def begun(query: Query) -> _Stream:
            found = assessment.assessment_of(self._case(query), query.others, self.explorer.uploads)
            return _Stream(assessment.described(found), assessment.parts(found), pack)

        return await self._streamed(request, begun)

    async def _streamed(self, request: Request, begin: Callable[[Query], _Stream]) -> Response:
        stream = await self._in_thread(lambda: begin(Query(request.query_params)))
        return StreamingResponse(
            self._parts(stream, self._naming(request)), media_type="application/octet-stream", headers=_FRESH
        )

    async def _parts(self, stream: _Stream, naming: _Naming) -> AsyncIterator[bytes]:
        """Parts of a stream as bytes; the work ends with the reader."""
        yield _framed(json.dumps({**stream.about, "problem": None}).encode())
        async with self._maps:
            with low_priority() as executor:
                try:
                    while (part := await asyncio.wrap_future(executor.submit(_next, stream, naming))) is not None:
                        yield part
                finally:
                    with anyio.CancelScope(shield=True):
                        await asyncio.wrap_future(executor.submit(stream.parts.close))

    async def export(self, request: Request) -> Response:
        """Return a figure or a table of a case as a file."""
        query = Query(request.query_params)
        form = query.given.get("form", "")
        content = await self._in_thread(lambda: self.explorer.export(query.texts(), form, query.window))
        headers = {**_FRESH, "content-disposition": f"attachment; filename=rocking-response.{quote(form)}"}
        return Response(content, media_type=EXPORTS[form], headers=headers)

    def _receiving(self, take: Callable[[str, bytes], dict[str, Any]]) -> Callable[[Request], Awaitable[Response]]:
        """Return what takes a file, the raw body, and says what it is."""

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

    async def compared(self, request: Request) -> Response:
        """Return two cases as one table."""
        query = Query(request.query_params)
        first, second = (query.given.get(name, name)[:120] for name in ("first", "second"))
        content = await self._in_thread(
            lambda: self.explorer.compared_as_csv(*query.compared, (first, second), **query.comparison)
        )
        headers = {**_FRESH, "content-disposition": "attachment; filename=rocking-compare.csv"}
        return Response(content, media_type=EXPORTS["csv"], headers=headers)

    async def record(self, request: Request) -> Response:
        """Say what a file that is kept is, read with the step and the units that are given now."""
        query, uploads = Query(request.query_params), self.explorer.uploads
        key, units = request.path_params["key"], query.given.get("units") or None
        found = await self._in_thread(lambda: uploads.contents(key, query.number("dt"), units))
        return JSONResponse(found, headers=_FRESH)

    async def forget(self, request: Request) -> Response:
        """Forget a file that is kept."""
        usage = await self._in_thread(lambda: self.explorer.forget(request.path_params["key"]))
        return JSONResponse(usage, headers=_FRESH)


class _Stream(NamedTuple):
    """What comes in parts: what is said of it first, the parts, and how one is written."""

    about: dict[str, Any]
    parts: Generator[Any]
    written: Callable[[Any], bytes]


def _next(stream: _Stream, naming: _Naming) -> bytes | None:
    """Return the next part as bytes, or what went wrong; None when all have come."""
    try:
        part = next(stream.parts, None)
    except RockingError as error:
        return _framed(json.dumps(_problem(error, naming)).encode())
    return None if part is None else _framed(stream.written(part))


def _part_of_map(part: maps.Part) -> bytes:
    head = struct.pack("<II", part.stride, len(part.points))
    return head + part.points.astype("<u4").tobytes() + part.values.astype("<f4").tobytes()


def _framed(data: bytes) -> bytes:
    """Return data behind its length, filled up so that what follows starts at a multiple of 4."""
    padded = data + b" " * (-len(data) % 4)
    return struct.pack("<I", len(padded)) + padded


def _static(files: Mapping[str, bytes], name: str, headers: Mapping[str, str]) -> Response:
    suffix = name[name.rfind(".") :]
    if name not in files or suffix not in TYPES:
        return Response("there is no such file", 404, headers=dict(_FRESH), media_type="text/plain")
    return Response(files[name], media_type=TYPES[suffix], headers=dict(headers))


def _problem(error: RockingError, naming: _Naming) -> dict[str, str | None]:
    """Return the sentence of an error, in which fields are called as the page calls them, and the argument."""
    return {"problem": error.text(naming), "argument": error.argument}


def _too_large() -> Response:
    problem = f"a file may be {LARGEST // 2**20} MiB large: cut a record into smaller files, or make a mesh coarser"
    return JSONResponse({"problem": problem, "argument": None}, 413, headers={**_FRESH, "connection": "close"})


async def _failure(_: Request, error: Exception) -> Response:
    problem = f"this could not be computed ({type(error).__name__}); please report it"
    return JSONResponse({"problem": problem, "argument": None}, 500, headers=_FRESH)


@contextmanager
def low_priority() -> Iterator[Executor]:
    """Give an executor of one thread that takes the processor only where nobody else wants it (on Linux)."""
    with ThreadPoolExecutor(1, "rocking-low-priority", initializer=_lower_priority) as executor:
        yield executor


def _lower_priority() -> None:
    if sys.platform == "linux":
        os.setpriority(os.PRIO_PROCESS, threading.get_native_id(), 19)  # lowest priority of all
