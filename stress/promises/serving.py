"""The page's server, as another program meets it: who gets what answer, from where, and what it leaves on the disk.

A server of its own runs for every part, with a home, a folder and a place for temporary files that are empty before.
"""

from __future__ import annotations

import contextlib
import http.client
import json
import os
import random
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final
from urllib.parse import quote

import rocking
from promises.promise import Found, Promise

#: Of a part: requests, file names, and connections that stay half open.
REQUESTS: Final = 250
NAMES: Final = 38
CONNECTIONS: Final = 150

#: Longest that an answer may take while others keep connections open, s, or times what it takes without them.
_SOON: Final = 10.0

#: Routes of the server: what a method is answered with once the request is let in. Other methods are not allowed (405),
#: and HEAD is answered like GET.
ROUTES: Final[dict[str, dict[str, int]]] = {
    "/": {"GET": 200},
    "/page/main.js": {"GET": 200},
    "/page/index.html": {"GET": 404},  # a template
    "/page/nothing.js": {"GET": 404},
    "/page/..%2fserver.py": {"GET": 404},
    "/api/start": {"GET": 200},
    "/api/case?p=2&alpha=0.2&motion=one-sine:amplitude=3,frequency=1": {"GET": 200},
    "/api/case?p=nothing": {"GET": 422},
    "/api/details?p=2&alpha=0.2&motion=one-sine:amplitude=3,frequency=1": {"GET": 200},
    "/api/list": {"GET": 200},
    "/api/assessment?p=nothing": {"GET": 422},
    "/api/study": {"GET": 422},
    "/api/export?form=exe": {"GET": 422},
    "/api/map?x=nothing": {"GET": 422},
    "/api/sweep?x=nothing": {"GET": 422},
    "/api/files?name=a.csv": {"POST": 422},
    "/api/files?name=a.stl": {"POST": 422},
    "/api/remove?key=none": {"GET": 422},
    "/api/nothing": {},
    "/nothing": {},
}
_METHODS: Final = ("GET", "HEAD", "POST", "PUT", "DELETE", "OPTIONS")
_ORIGINS: Final = (None, "null", "http://evil.example", "http://127.0.0.1:1")
_CARRIED: Final = (None, "Bearer {secret}", "Bearer {secret}x", "Basic {secret}", "Bearer ", "Bearer {other}")

#: Names that a file is sent under.
_WORDS: Final = (
    "..",
    ".",
    "",
    "~",
    "C:",
    "con",
    "nul",
    "etc",
    "passwd",
    "record.csv",
    "a" * 300,
    "é",
    "\u202egpj",
    "$HOME",
)
_JOINTS: Final = ("/", "\\", "//", "\0", "\r\n", "%2f", "%00", ";", "'", '"', " ", "`id`", "<b>", "\u2028", "|")
_RECORD: Final = b"time (s), a (g)\n0.00, 0.0\n0.01, 0.5\n0.02, -0.1\n0.03, 0.0\n"


@dataclass(frozen=True)
class Running:
    """A server that runs: its process, its port, the secret, and the folder in which all it may write is."""

    process: subprocess.Popen[str]
    port: int
    secret: str
    folder: Path

    def status(self, method: str, path: str, headers: dict[str, str], body: bytes = b"") -> tuple[int, bytes]:
        """Send a request, with these headers alone, and return status and body of the answer."""
        with contextlib.closing(http.client.HTTPConnection("127.0.0.1", self.port, timeout=600)) as connection:
            connection.putrequest(method, path, skip_host=True, skip_accept_encoding=True)
            for name, value in headers.items():
                connection.putheader(name, value)
            connection.putheader("content-length", str(len(body)))
            connection.endheaders(body)
            answer = connection.getresponse()
            return answer.status, answer.read()

    @property
    def own(self) -> dict[str, str]:
        """Headers of the server's own page."""
        here = f"127.0.0.1:{self.port}"
        return {"host": here, "origin": f"http://{here}", "authorization": f"Bearer {self.secret}"}


@contextlib.contextmanager
def served() -> Iterator[Running]:
    """Run `rocking explore` in an empty folder, and open its link."""
    with tempfile.TemporaryDirectory() as where:
        folder = Path(where)
        for name in ("home", "here", "tmp"):
            (folder / name).mkdir()
        about = {"HOME": folder / "home", "TMPDIR": folder / "tmp", "PYTHONUNBUFFERED": 1}
        kept = {name: value for name, value in os.environ.items() if not name.startswith("XDG_")}
        with subprocess.Popen(
            [sys.executable, "-m", "rocking", "explore", "--no-open"],
            cwd=folder / "here",
            stdout=subprocess.PIPE,
            text=True,
            env=kept | {name: str(value) for name, value in about.items()},
            preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
        ) as process:
            try:
                assert process.stdout is not None
                found = re.search(r"http://127\.0\.0\.1:(\d+)/(?:block)?#token=([\w-]+)", process.stdout.readline())
                assert found is not None
                opening = Running(process, int(found[1]), found[2], folder)
                status, secret = opening.status("POST", "/api/secret", opening.own)
                assert status == 200
                yield Running(process, int(found[1]), secret.decode(), folder)
            finally:
                process.kill()


def specified(method: str, path: str, carried: str | None) -> int:
    """Return the status that a request must be answered with."""
    route, known = ROUTES[path], "GET" if method == "HEAD" else method
    if not route or known not in route:
        return 404 if not route else 405
    return route[known] if carried == "Bearer {secret}" or not path.startswith("/api/") else 403


def judge(part: int) -> Found:
    """Start a server, ask it, trouble it, and look at what it leaves."""
    found, rng = Found(parts=1), random.Random(f"serving {part}")
    package = Path(rocking.__file__).parent
    before = _listed(package)
    with served() as running:
        _judge_requests(found, rng, running)
        _judge_names(found, rng, running)
        _judge_half_open(found, running, part)
        _judge_listeners(found, running)
        _judge_that(found, running.process.poll() is None, "the server has ended")
        left = [str(path.relative_to(running.folder)) for path in running.folder.rglob("*") if path.is_file()]
        _judge_that(found, not left, f"files were written: {left[:5]}")
    _judge_that(found, _listed(package) == before, "files of the package were changed")
    return found


def _listed(folder: Path) -> dict[str, int]:
    paths = (path for path in folder.rglob("*") if path.is_file() and "__pycache__" not in path.parts)
    return {str(path): path.stat().st_mtime_ns for path in paths}


def _judge_that(found: Found, holds: bool, otherwise: str) -> None:
    found.cases += 1
    found.judged += 1
    if not holds:
        found.fail(otherwise)


def _judge_requests(found: Found, rng: random.Random, running: Running) -> None:
    for _ in range(REQUESTS):
        method, path = rng.choice(_METHODS), rng.choice([*ROUTES])
        origin, carried = rng.choice(_ORIGINS), _CARRIED[1] if rng.random() < 0.5 else rng.choice(_CARRIED)
        headers = {"host": f"127.0.0.1:{running.port}"} | ({} if origin is None else {"origin": origin})
        if carried is not None:
            headers["authorization"] = carried.format(secret=running.secret, other="x" * len(running.secret))
        status, body = running.status(method, path, headers, b"x" if method == "POST" else b"")
        expected = specified(method, path, carried)
        _judge_that(
            found,
            status == expected and running.secret.encode() not in body,
            f"{method} {path} from {origin!r} with {carried!r}: {status} and not {expected}",
        )
        found.notes[f"status {status}"] += 1


def _judge_names(found: Found, rng: random.Random, running: Running) -> None:
    for _ in range(NAMES):
        name = "".join(rng.choice(_WORDS) + rng.choice(_JOINTS) for _ in range(rng.randrange(1, 5))) + rng.choice(
            _WORDS
        )
        status, body = running.status("POST", f"/api/files?name={quote(name)}", running.own, _RECORD)
        told = json.loads(body)
        shown = told.get("name", "")
        plain = status == 200 and shown.isprintable() and 0 < len(shown) <= 80 and not {*"/\\"} & {*shown}
        _judge_that(found, plain, f"a file called {name!r} is answered with {status} and called {shown!r}")
        if status == 200:
            path = f"/api/details?p=2&alpha=0.2&motion=file:{told['key']}"
            again, _ = running.status("GET", path, running.own)
            _judge_that(found, again == 200, f"the file called {name!r} is answered with {again} later")
        status, body = running.status("GET", f"/page/{quote(name)}", running.own)
        _judge_that(found, status in (307, 404), f"/page/{name!r} is answered with {status}")


def _judge_half_open(found: Found, running: Running, part: int) -> None:
    """Let others hold connections with nothing, half a head, half a body or a head by single letters; ask meanwhile."""
    head = f"HTTP/1.1\r\nHost: 127.0.0.1:{running.port}\r\n"
    known = f"{head}Authorization: Bearer {running.secret}\r\nOrigin: http://127.0.0.1:{running.port}\r\n"
    slow = f"GET / {head}Slow: "
    halves = ("", f"GET / {head}", f"POST /api/files?name=a {known}Content-Length: 99\r\n\r\nx", "\0\1\2\r\n", slow)
    held = []
    start = time.monotonic()
    running.status("GET", "/api/start", running.own)
    soon = _SOON * max(1.0, time.monotonic() - start)
    try:
        for k in range(CONNECTIONS):
            one = socket.create_connection(("127.0.0.1", running.port), timeout=600)
            one.sendall(halves[(part + k) % len(halves)].encode())
            held.append(one)
        for _ in range(5):
            start = time.monotonic()
            status, _ = running.status("GET", "/api/start", running.own)
            late = time.monotonic() - start
            _judge_that(found, status == 200 and late < soon, f"{status} after {late:.1f} s, with connections held")
    finally:
        for one in held:
            one.close()


def _judge_listeners(found: Found, running: Running) -> None:
    own = f"/proc/{running.process.pid}"
    sockets = set()
    for each in Path(own, "fd").iterdir():
        with contextlib.suppress(OSError):
            sockets.add(str(each.readlink()))
    listening = []
    for family, here in (("tcp", "0100007F"), ("tcp6", "00000000000000000000000001000000")):
        for line in Path(own, "net", family).read_text().splitlines()[1:]:
            _, local, _, state, *_, inode = line.split()[:10]
            if state == "0A" and f"socket:[{inode}]" in sockets:
                listening.append(local.partition(":")[0] == here)
    _judge_that(
        found, listening == [True], f"{len(listening)} listeners, {sum(listening)} of them of this machine alone"
    )


def table(found: Found) -> str:
    """Say how requests were answered."""
    answers = ", ".join(f"{count} {name.split()[1]}" for name, count in sorted(found.notes.items()))
    return f"Requests were answered with these statuses: {answers}.\n"


PROMISE = Promise(
    name="serving",
    says="the page's server answers the secret alone, and writes nothing",
    parts=4,
    small=1,
    judge=judge,
    table=table,
)
