"""The application: requests to calls of the core, payloads to bytes. It knows no mechanics."""

from __future__ import annotations

import json
import math
import secrets
import struct
from collections.abc import AsyncIterator, Callable, Iterator, Mapping
from contextlib import asynccontextmanager
from functools import partial
from typing import Any, Final, TypeVar
from urllib.parse import quote

import anyio
import anyio.to_thread
import numpy as np
from starlette.applications import Starlette
from starlette.requests import ClientDisconnect, Request
from starlette.responses import JSONResponse, Response, StreamingResponse
from starlette.routing import Route

from rocking.errors import InvalidOption, RockingError
from rocking.explorer import assets, map_code, maps
from rocking.explorer.background import behind_others, result_of
from rocking.explorer.case import NAMES, read_case
from rocking.explorer.core import EXPORTS, Explorer, Payload
from rocking.explorer.offers import offers
from rocking.explorer.shelf import LARGEST
from rocking.explorer.studies import StudyView
from rocking.explorer.warming import Warming
from rocking.quantities import number
from rocking.tables import plain

T = TypeVar("T")

#: Prefix of the texts of the case that is compared with.
OTHER: Final = "other."

#: Computations at the same time; the rest wait for their turn.
_THREADS: Final = 4
_MAPS: Final = 2

_SENT_WITH_ALL: Final = {
    "x-content-type-options": "nosniff",
    "referrer-policy": "no-referrer",
    "cross-origin-resource-policy": "same-origin",
}
_FRESH: Final = {**_SENT_WITH_ALL, "cache-control": "no-store"}
_FOR_GOOD: Final = {**_SENT_WITH_ALL, "cache-control": "private, max-age=31536000, immutable"}


class App:
    """The explorer's application.

    Parameters
    ----------
    explorer : Explorer
        What computes.
    opening : mapping of str to str
        Texts with which the page opens where its address has none.
    study : StudyView, optional
        A study to show as a map.
    framed_by : str
        Sources of pages that may show this one in a frame, as a content security policy writes them.
    """

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
        self.warming = Warming()
        self.files = assets.page_files()
        self.library = {name: (assets.library_folder() / name).read_bytes() for name in assets.LIBRARY}
        self._threads = anyio.CapacityLimiter(_THREADS)
        self._maps = anyio.CapacityLimiter(_MAPS)
        self.asgi = Starlette(
            routes=[
                Route("/", self.page),
                Route("/page/{name}", self.file),
                Route("/library/{name}", self.script),
                Route("/api/start", self.start),
                Route("/api/case", self.case),
                Route("/api/window", self.window),
                Route("/api/words", self.words),
                Route("/api/schemes", self.schemes),
                Route("/api/compare", self.compare),
                Route("/api/map", self.map),
                Route("/api/map/point", self.point),
                Route("/api/study", self.study_map),
                Route("/api/study/point", self.study_point),
                Route("/api/export", self.export),
                Route("/api/records", self.upload, methods=["POST"]),
                Route("/api/records/{key}", self.record),
            ],
            exception_handlers={RockingError: _refusal, Exception: _failure},
            lifespan=self._lifespan,
        )

    @asynccontextmanager
    async def _lifespan(self, _: Starlette) -> AsyncIterator[None]:
        self.warming.start()
        yield

    async def page(self, _: Request) -> Response:
        """Return the page, with a nonce of its own."""
        nonce = secrets.token_urlsafe(16)
        policy = (
            "default-src 'none'; script-src 'self'; connect-src 'self'; "
            f"style-src 'self' 'nonce-{nonce}'; img-src 'self' data:; base-uri 'none'; form-action 'none'; "
            f"frame-ancestors {self.framed_by}"
        )
        html = self.files["index.html"].replace(b"NONCE", nonce.encode())
        return Response(html, media_type="text/html", headers={**_FRESH, "content-security-policy": policy})

    async def file(self, request: Request) -> Response:
        """Return one of the page's own files."""
        return _static(self.files, request.path_params["name"], {**_SENT_WITH_ALL, "cache-control": "no-cache"})

    async def script(self, request: Request) -> Response:
        """Return a file of the plotting library."""
        return _static(self.library, request.path_params["name"], _FOR_GOOD)

    async def start(self, _: Request) -> Response:
        """Return what the page offers, with what it opens, and how far the compiling has come."""
        study = None if self.study is None else await self._in_thread(self.study.describe)
        return _json({**offers(), "opening": self.opening, "study": study, "warming": self.warming.state()})

    async def case(self, request: Request) -> Response:
        """Return all of a case."""
        texts, window = _texts(request), _window(request)
        return _packed(await self._in_thread(lambda: self.explorer.case(texts, window)))

    async def window(self, request: Request) -> Response:
        """Return the arrays of a window."""
        texts, window = _texts(request), _window(request)
        points = int(_number(request, "points") or 3000)
        ground = request.query_params.get("ground") == "1"
        if window is None:
            raise InvalidOption("a window needs from= and to=, in s")
        work = partial(self.explorer.window, texts, window, ground=ground, points=points)
        return _packed(await self._in_thread(work))

    async def words(self, request: Request) -> Response:
        """Return the summary of a case."""
        texts = _texts(request)
        return _json(await self._in_thread(lambda: self.explorer.words(texts)))

    async def schemes(self, request: Request) -> Response:
        """Return what every treatment of chattering makes of a case."""
        texts = _texts(request)
        return _json(await self._in_thread(lambda: self.explorer.schemes(texts)))

    async def compare(self, request: Request) -> Response:
        """Return a case and another one, in the same window."""
        texts, window = _texts(request), _window(request)
        changed = _texts(request, OTHER)
        return _packed(await self._in_thread(lambda: self.explorer.compare(texts, changed, window)))

    async def map(self, request: Request) -> Response:
        """Stream a map, coarse to fine: what it shows, then parts of it."""
        texts = _texts(request)
        grid = maps.grid_of(read_case(texts, self.explorer.shelf), _others(request))
        about = await self._in_thread(lambda: {**maps.described(grid), **map_code.described(grid)})
        return StreamingResponse(self._map(grid, about), media_type="application/octet-stream", headers=_FRESH)

    async def point(self, request: Request) -> Response:
        """Return the texts of the case at a point of a map."""
        grid = maps.grid_of(read_case(_texts(request), self.explorer.shelf), _others(request))
        x, y = _number(request, "at_x"), _number(request, "at_y")
        if x is None or y is None:
            raise InvalidOption("a point of a map needs at_x= and at_y=")
        return _json(maps.texts_at(grid, x, y))

    async def study_map(self, request: Request) -> Response:
        """Return a slice of the study as a map."""
        study = self._study()
        return _packed(await self._in_thread(lambda: study.slice(_others(request))))

    async def study_point(self, request: Request) -> Response:
        """Return the texts of a simulation of the study."""
        study = self._study()
        return _json(await self._in_thread(lambda: study.texts_at(_others(request), self.explorer.shelf)))

    async def export(self, request: Request) -> Response:
        """Return a figure or a table of a case as a file."""
        texts, window, form = _texts(request), _window(request), request.query_params.get("form", "")
        content = await self._in_thread(lambda: self.explorer.export(texts, form, window))
        headers = {**_FRESH, "content-disposition": f"attachment; filename=rocking-response.{quote(form)}"}
        return Response(content, media_type=EXPORTS[form], headers=headers)

    async def upload(self, request: Request) -> Response:
        """Keep a record file, the raw body, and say what it is."""
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
        return _json(await self._in_thread(lambda: self._kept(name, bytes(data))))

    async def record(self, request: Request) -> Response:
        """Say what a file that is kept is, read with what was told since."""
        key, dt = request.path_params["key"], _number(request, "dt")
        units = request.query_params.get("units") or None
        return _json(await self._in_thread(lambda: self.explorer.shelf.contents(key, dt, units)))

    def _kept(self, name: str, data: bytes) -> dict[str, Any]:
        shelf = self.explorer.shelf
        return shelf.contents(shelf.put(name, data))

    def _study(self) -> StudyView:
        if self.study is None:
            raise InvalidOption("no study is open: start with rocking explore FOLDER")
        return self.study

    async def _in_thread(self, work: Callable[[], T]) -> T:
        return await anyio.to_thread.run_sync(work, limiter=self._threads)

    async def _map(self, grid: maps.MapGrid, about: dict[str, Any]) -> AsyncIterator[bytes]:
        """Parts of a map as bytes; the work ends with the reader."""
        yield _framed(json.dumps({**about, "problem": None}).encode())
        async with self._maps:
            with behind_others() as thread:
                found = maps.parts(grid)
                try:
                    while (part := await result_of(thread, partial(_next, found))) is not None:
                        yield part
                finally:
                    with anyio.CancelScope(shield=True):
                        await result_of(thread, found.close)  # type: ignore[attr-defined]


def pack(payload: Payload) -> bytes:
    """Return a payload as bytes: length of the header (4 bytes), header as JSON, arrays of doubles from multiples of 8.

    Examples
    --------
    >>> import numpy as np
    >>> packed = pack(Payload({"a": 1}, {"b": np.array([1.0])}))
    >>> len(packed) % 8, packed[4:20]
    (0, b'{"a":1,"arrays":')
    """
    lengths = {name: values.size for name, values in payload.arrays.items()}
    header = json.dumps({**plain(payload.header), "arrays": lengths}, separators=(",", ":"), allow_nan=False).encode()
    header += b" " * (-(4 + len(header)) % 8)
    arrays = (np.ascontiguousarray(values, "<f8").tobytes() for values in payload.arrays.values())
    return b"".join([struct.pack("<I", len(header)), header, *arrays])


def _next(found: Iterator[maps.Part]) -> bytes | None:
    """Return the next part of a map as bytes, or what went wrong; None when it is complete."""
    try:
        part = next(found, None)
    except RockingError as error:
        return _framed(json.dumps({"problem": str(error)}).encode())
    if part is None:
        return None
    head = struct.pack("<II", part.stride, len(part.points))
    return _framed(head + part.points.astype("<u4").tobytes() + part.values.astype("<f4").tobytes())


def _framed(data: bytes) -> bytes:
    """Return data behind its length, filled up so that what follows starts at a multiple of 4."""
    padded = data + b" " * (-len(data) % 4)
    return struct.pack("<I", len(padded)) + padded


def _texts(request: Request, prefix: str = "") -> dict[str, str]:
    """Return the texts of a case in an address."""
    given = request.query_params
    return {name: given[prefix + name] for name in NAMES if given.get(prefix + name)}


def _others(request: Request) -> dict[str, str]:
    """Return what an address says beside the case."""
    return {name: value for name, value in request.query_params.items() if name not in NAMES}


def _window(request: Request) -> tuple[float, float] | None:
    start, end = _number(request, "from"), _number(request, "to")
    return None if start is None or end is None else (start, end)


def _number(request: Request, name: str) -> float | None:
    text = request.query_params.get(name)
    if not text:
        return None
    value = number(text[:40], name)
    if not math.isfinite(value):
        raise InvalidOption(f"{name} must be a finite number")
    return value


def _static(files: Mapping[str, bytes], name: str, headers: Mapping[str, str]) -> Response:
    suffix = name[name.rfind(".") :]
    if name not in files or suffix not in assets.TYPES:
        return Response("there is no such file", 404, headers=dict(_FRESH), media_type="text/plain")
    return Response(files[name], media_type=assets.TYPES[suffix], headers=dict(headers))


def _packed(payload: Payload) -> Response:
    return Response(pack(payload), media_type="application/octet-stream", headers=_FRESH)


def _json(value: Any) -> Response:
    return JSONResponse(plain(value), headers=_FRESH)


def _too_large() -> Response:
    problem = f"a record file may be {LARGEST // 2**20} MiB large: cut it into smaller ones"
    return JSONResponse({"problem": problem}, 413, headers={**_FRESH, "connection": "close"})


async def _refusal(_: Request, error: Exception) -> Response:
    return JSONResponse({"problem": str(error)}, 422, headers=_FRESH)


async def _failure(_: Request, error: Exception) -> Response:
    kind = type(error).__name__
    return JSONResponse({"problem": f"this could not be computed ({kind}); please report it"}, 500, headers=_FRESH)
