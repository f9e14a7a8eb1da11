"""The server: what it answers, byte by byte; what it refuses; how much it takes."""

import contextlib
import io
import json
import math
import os
import re
import socket
import struct
import subprocess
import sys
import threading
import time
import tracemalloc
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from urllib.parse import urlencode

import httpx
import numpy as np
import pytest
from explorer_client import Client, bearing, clients, let_in, opened_by

import rocking
from rocking.core.threads import ITEMS_AHEAD_PER_THREAD, count_cores
from rocking.errors import OptionError, RockingError, StudyError
from rocking.explorer import launch, server, uploads
from rocking.explorer.core import Explorer
from rocking.explorer.inputs import read_case
from rocking.explorer.launch import Server
from rocking.explorer.server import EXCHANGE, App
from rocking.explorer.studies import StudyView
from rocking.explorer.uploads import MAX_FILE_SIZE, UploadStore

PORT = 8123
OURS = f"http://127.0.0.1:{PORT}"
STATUE = {"width": "0.24", "height": "1.1", "motion": "ridgecrest-clc-090", "pga": "0.4g"}
SINE = {"p": "1", "alpha": "0.2", "restitution": "0.92", "motion": "sine:amplitude=2.02,frequency=0.3,cycles=2.5"}


@pytest.fixture(scope="module")
def explorer():
    return Explorer()


@pytest.fixture(scope="module")
def opened():
    """Open the page of an application as a browser."""
    with clients() as portal:

        def open_page(app):
            return let_in(Client(portal, app.asgi, OURS), app.create_token())

        yield open_page


@pytest.fixture(scope="module")
def page(explorer, opened):
    return opened(App(explorer))


def page_files():
    """Contents of the page's own files by path."""
    return {str(file.relative_to(server.FOLDER)): file.read_bytes() for file in server.FOLDER.rglob("*.*")}


def unpacked(data):
    (length,) = struct.unpack_from("<I", data)
    header = json.loads(data[4 : 4 + length])
    arrays, at = {}, 4 + length
    assert at % 8 == 0
    for name, size in header["arrays"].items():
        arrays[name] = np.frombuffer(data, "<f8", size, at)
        at += 8 * size
    assert at == len(data)
    return header, arrays


def parts_of(data):
    """Header and arrays of each part of a stream."""
    at, found = 0, []
    while at < len(data):
        (length,) = struct.unpack_from("<Q", data, at)
        found.append(unpacked(data[at + 8 : at + 8 + length]))
        at += 8 + length
    assert at == len(data)
    return found


# What is answered


def test_a_case_comes_as_header_and_aligned_arrays(page, explorer):
    header, arrays = unpacked(page.get("/api/case", params=STATUE).content)
    response = explorer.simulate(STATUE).response
    assert header["peak_rotation"] == response.peak_rotation
    assert np.array_equal(arrays["impact_time"], response.impacts["time"])
    header, arrays = unpacked(page.get("/api/details", params={**STATUE, "from": "232", "to": "233"}).content)
    assert header["command"].startswith("rocking simulate ridgecrest-clc-090")
    assert "rocking.records.load('ridgecrest-clc-090')" in header["python"]
    assert header["summary"][0][0] == "block" and len(arrays["displacement"]) > 100


def test_a_window_comes_with_times_from_its_start(page, explorer):
    header, arrays = unpacked(page.get("/api/case", params={**STATUE, "from": "232", "to": "233"}).content)
    assert header["window"] == {"from": 232.0, "to": 233.0, "impacts": 3, "unresolved": None}
    assert arrays["time"][0] == 0.0
    response = explorer.simulate(STATUE).response
    assert arrays["rotation"] == pytest.approx(response.rotation(232.0 + arrays["time"]), abs=1e-12)


def test_what_is_not_finite_is_null_in_a_header(page):
    header, _ = unpacked(page.get("/api/case", params={**STATUE, "pga": "0.05g"}).content)
    assert header["overturn_time"] is None
    assert header["share_at_rest"] is None


def test_a_map_comes_coarse_to_fine_and_whole(page):
    axes = {"x": "omega", "y": "a", "points": "24"}
    (about, _), *parts = parts_of(page.get("/api/map", params={**SINE, **axes}).content)
    assert about["shape"] == [24, 24]
    assert about["outcomes"][1] == "complete"
    assert len(about["curve"]) == 24
    case = read_case(SINE, UploadStore())
    threshold = min(case.block.uplift_thresholds("nonlinear"))
    assert about["case"] == pytest.approx([2.0 * math.pi * 0.3, case.motion.pga / threshold])
    seen, strides = np.zeros(576, int), []
    for header, arrays in parts:
        strides.append(header["stride"])
        seen[arrays["points"].astype(int)] += 1
        assert len({len(values) for values in arrays.values()}) == 1
    assert (seen == 1).all()
    # Tasks begin coarse to fine, a few at a time: no part comes before more coarser ones than may be under way.
    order = np.array(strides)
    overtaken = [int(np.sum(order[k:] > stride)) for k, stride in enumerate(strides)]
    assert sorted(set(strides)) == [1, 2, 4, 8] and len(strides) == 20
    assert max(overtaken) < ITEMS_AHEAD_PER_THREAD * count_cores()


def test_the_case_at_a_point_of_a_map(page):
    params = {**SINE, "x": "omega", "y": "a", "at_x": "2", "at_y": "1.03"}
    texts = page.get("/api/map/point", params=params).json()
    header, _ = unpacked(page.get("/api/case", params=texts).content)
    assert header["motion"]["pga_g"] == pytest.approx(1.03 * math.tan(0.2), rel=1e-9)


def test_an_instant_is_read_or_refused_by_name(page):
    assert page.get("/api/at", params={**SINE, "at": "1.5 s"}).json()["time"] == 1.5
    refused = page.get("/api/at", params={**SINE, "at": "-3"})
    assert refused.status_code == 422 and refused.json()["argument"] == "at"
    assert refused.json()["problem"].startswith("“Time” must be within the response")


def test_what_a_case_settles_on_comes_as_header_and_arrays(page):
    texts = {**SINE, "motion": "sine:amplitude=3,frequency=0.5,cycles=2"}
    header, arrays = unpacked(page.get("/api/orbit", params=texts).content)
    assert "orbit of" in header["sentence"] and header["duration"] == 2.0
    assert len(arrays["rotation"]) == len(arrays["velocity"]) > 1000
    for path in ("/api/orbit", "/api/sweep"):
        refused = page.get(path, params=STATUE)
        assert refused.status_code == 422 and refused.json()["argument"] == "motion"
        assert refused.json()["problem"].startswith("periodic motion requires a sine")


def test_a_sweep_comes_coarse_to_fine_and_whole(page):
    texts = {**SINE, "motion": "sine:amplitude=3,frequency=0.5,cycles=2", "sweep_points": "24"}
    (about, _), *parts = parts_of(page.get("/api/sweep", params=texts).content)
    assert about["name"] == "a" and len(about["values"]) == 24
    assert "dynamics.bifurcation_diagram" in about["python"]
    seen, share, stride = {"up": [], "down": []}, 0.0, 8
    for header, arrays in parts:
        assert header["share"] > share and header["stride"] <= stride
        share, stride = header["share"], header["stride"]
        if stride == 1:
            seen[header["direction"]] += header["indices"]
        assert 2 * len(arrays["drawn"]) == len(arrays["states"])
    assert share == 1.0 and seen == {"up": [*range(24)], "down": [*range(24)]}


def test_the_case_at_a_point_of_a_sweep(page):
    params = {**SINE, "sweep": "a", "at": "1.5", "u": "0.01", "v": "-0.2"}
    texts = page.get("/api/sweep/point", params=params).json()
    assert (texts["initial_rotation"], texts["initial_velocity"]) == ("0.01", "-0.2")
    header, _ = unpacked(page.get("/api/orbit", params=texts).content)
    assert header["at"]["a"] == pytest.approx(1.5, rel=1e-12)


FORMS = {
    "csv": b"time_s,rotation_rad", "events.csv": b"time_s,kind,side", "impacts.csv": b"time_s,side",
    "nc": b"\x89HDF",
}  # fmt: skip


@pytest.mark.cases(fast=3)
@pytest.mark.parametrize(("form", "start"), FORMS.items())
def test_every_export_is_a_download_of_its_kind(page, form, start):
    texts = {**SINE, "model": "linear", "motion": "one-sine:amplitude=2.5,frequency=1"}
    answer = page.get("/api/export", params={**texts, "form": form})
    assert answer.status_code == 200 and answer.content.startswith(start)


def test_the_page_has_a_policy(page):
    answer = page.get("/")
    policy = dict(part.strip().split(" ", 1) for part in answer.headers["content-security-policy"].split(";"))
    assert policy["default-src"] == policy["frame-ancestors"] == "'none'"
    assert policy["script-src"] == policy["style-src"] == policy["connect-src"] == "'self'"
    assert "unsafe" not in answer.headers["content-security-policy"]


def test_the_secret_is_given_once_and_required(explorer):
    app = App(explorer)
    with clients() as portal:
        stranger = Client(portal, app.asgi, OURS)
        paths = [route.path for route in app.asgi.routes if route.path.startswith("/api/") and route.path != EXCHANGE]
        assert len(paths) >= 15
        for path in paths:
            for headers in ({}, bearing("x"), bearing(""), {"authorization": app._secret}):
                answer = stranger.request("POST" if path == "/api/files" else "GET", path, headers=headers)
                assert answer.status_code == 403, path
                assert app._secret not in answer.text
        assert stranger.post(EXCHANGE, headers=bearing("x")).status_code == 403
        token = app.create_token()
        answer = stranger.post(EXCHANGE, headers=bearing(token))
        assert (answer.status_code, answer.text) == (200, app._secret)
        assert stranger.post(EXCHANGE, headers=bearing(token)).status_code == 403
        assert stranger.get("/api/start", headers=bearing(app._secret)).status_code == 200
        assert stranger.get("/api/start", params={"authorization": app._secret}).status_code == 403
        assert not stranger.get("/").headers.get("set-cookie")
        assert "access-control-allow-origin" not in stranger.get("/api/start", headers={"origin": OURS}).headers
        first = app.create_token()
        for _ in range(200):
            app.create_token()
        assert stranger.post(EXCHANGE, headers=bearing(first)).status_code == 403


def test_the_page_loads_nothing_from_elsewhere():
    files = page_files()
    assert len(files) >= 15
    for name, content in files.items():
        text = content.decode()
        addresses = set(re.findall(r"https?://[^\s\"'`)]+", text)) - {"http://www.w3.org/2000/svg"}
        assert not addresses, name
        assert "innerHTML" not in text, name
        assert not re.search(r"\beval\(|new Function", text), name


def test_every_module_that_is_imported_is_served(page):
    texts = {name: content.decode() for name, content in page_files().items()}
    own = {name: text for name, text in texts.items() if "/" not in name}
    imports = {each for text in own.values() for each in re.findall(r'from "\./([\w./-]+)"', text)}
    asked = [*re.findall(r'(?:src|href)="(/[^"]+)"', texts["index.html"]), *(f"/page/{each}" for each in imports)]
    assert len(imports) >= 12 and len(asked) >= 16
    for name in asked:
        assert page.get(name).status_code == 200, name


@pytest.mark.parametrize(
    ("texts", "argument", "words"),
    [
        ({"width": "-1"}, "width", "“Width” must be a positive number"),
        ({"restitution": "0.9999"}, "restitution", "“Restitution η”"),
        ({"pgv": "1"}, "pga", "“Peak acceleration” and “Peak velocity” scale the same motion"),
        ({"pga": "-1g"}, "pga", "“Peak acceleration” must be a positive number, in m/s^2, not -9.80665"),
        ({"vertical": "nothing-up"}, "vertical", "“Vertical component”: there is no shipped record"),
        ({"motion": "nothing"}, "motion", "“Shaken by”"),
        ({"motion": "none"}, "pga", "“Peak acceleration”"),
        ({"motion": "file:00ff"}, "motion", "“Shaken by”"),
        ({"motion": "given:00ff"}, "motion", "“Shaken by”"),
        ({"motion": "sine:amplitude=1,frequency=1,cycles=2000"}, "cycles", "“Cycles” of a pulse"),
        ({"friction": "-1"}, "friction", "“Friction coefficient”"),
        ({"height": ""}, "width", "“Height”"),
    ],
)
def test_an_error_names_the_field_by_its_label_and_the_argument_that_is_wrong(page, texts, argument, words):
    answer = page.get("/api/case", params={**STATUE, **texts})
    assert answer.status_code == 422
    assert answer.json()["argument"] == argument
    assert words in answer.json()["problem"]


def test_what_went_wrong_inside_says_nothing_of_the_inside(page, explorer, monkeypatch):
    monkeypatch.setitem(explorer.answers, "details", lambda query: 1 / 0)
    answer = page.get("/api/details", params=STATUE)
    assert answer.status_code == 500
    problem = "this could not be computed (ZeroDivisionError); please report it"
    assert answer.json() == {"problem": problem, "argument": None}


# Uploads


def test_a_record_is_uploaded_told_about_and_simulated(page):
    samples = rocking.records.load("el-centro-meloland-270").samples
    body = "\n".join(f"{value / 9.80665:.12g}" for value in samples)
    answer = page.post("/api/files", params={"name": "el centro.txt"}, content=body)
    found = answer.json()
    assert set(found["missing"]) == {"dt", "units"}
    assert found["name"] == "el centro.txt"
    texts = {"width": "0.24", "height": "1.1", "motion": f"file:{found['key']}", "dt": "0.01", "units": "g"}
    header, _ = unpacked(page.get("/api/case", params=texts).content)
    block = rocking.Block(width=0.24, height=1.1)
    expected = rocking.simulate(block, rocking.records.load("el-centro-meloland-270"))
    assert header["peak_rotation"] == pytest.approx(expected.peak_rotation, rel=1e-6)


@pytest.mark.thorough
def test_a_list_of_records_is_assessed_and_a_file_taken_out(page):
    key = page.post("/api/files", params={"name": "b_ns.txt"}, content=b"0\n1\n-1\n0\n" * 99).json()["key"]
    rows = [row for group in page.get("/api/list").json()["groups"] for row in group["rows"]]
    assert next(row for row in rows if row["key"] == key)["measures"] is None
    answered = page.get("/api/list", params={"answers": f"key={key}&dt=0.01&units=m/s2"}).json()
    (row,) = [row for group in answered["groups"] for row in group["rows"] if row["key"] == key]
    assert row["measures"]["pga"] == 1.0 and answered["usage"]["files"] >= 1
    assert page.post("/api/files", params={"name": "x.at2"}, content=AT2[:300] + b"x").status_code == 422
    assert page.get("/api/list").json()["usage"] == answered["usage"]
    records = "motion=el-centro-meloland-270;motion=el-centro-meloland-360"
    params = {**STATUE, "records": records, "levels": "4", "level_from": "0.2g", "level_to": "0.8g"}
    header, arrays = unpacked(page.get("/api/assessment", params=params).content)
    assert len(header["records"]) == 2 and "rocking.assess" in header["python"] and len(arrays["levels"]) == 4
    report = page.get("/api/export", params={**params, "form": "report.html"})
    assert report.content.startswith(b"<!DOCTYPE html>")
    assert report.headers["content-type"] == "application/octet-stream"
    assert page.get("/api/assessment", params=STATUE).status_code == 422
    assert page.get("/api/remove", params={"key": key}).status_code == 200
    assert page.get("/api/remove", params={"key": key}).status_code == 422


def test_a_body_that_is_too_large_is_refused_before_and_while_it_comes(page):
    answer = page.post(
        "/api/files", params={"name": "x"}, content=b"", headers={"content-length": str(MAX_FILE_SIZE + 1)}
    )
    assert answer.status_code == 413

    async def endless():
        while True:
            yield bytes(2**20)

    tracemalloc.start()
    assert page.post("/api/files", params={"name": "x"}, content=endless()).status_code == 413
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 4 * MAX_FILE_SIZE


def memory_of(act):
    """Peak of the memory that Python and NumPy take meanwhile, bytes, and what came of it in words."""
    tracemalloc.start()
    try:
        act()
        words = "read"
    except RockingError as error:
        words = str(error)
    finally:
        peak = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
    return peak, words


HEADED = b"time (s)" + b",a (g)" * 200 + b"\n"
AT2 = (Path(__file__).parent / "data" / "formats" / "nga.at2").read_bytes()


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"0\n" * (MAX_FILE_SIZE // 2), "8388608 lines, of which at most 1000000 are read here"),
        (b"0\r" * (MAX_FILE_SIZE // 2), "8388608 lines, of which at most 1000000 are read here"),
        (b"0\n" * 999_000, "999000 samples; at most 500000 are shown here"),
        pytest.param(b"0 " * (MAX_FILE_SIZE // 2), "8388608 samples; at most", marks=pytest.mark.thorough),
        pytest.param(b".1\n" * 490_000, "read", marks=pytest.mark.thorough),
        pytest.param(b"0;0\n" * 490_000, "the time does not increase", marks=pytest.mark.slow),
        pytest.param(AT2 + b"0\n" * 999_000, "the header specifies", marks=pytest.mark.slow),
        pytest.param(AT2 + b"0 " * (MAX_FILE_SIZE // 2 - 2000), "the header specifies", marks=pytest.mark.slow),
        pytest.param(HEADED + (b"0" + b",0" * 200 + b"\n") * 20_000, "the time does not", marks=pytest.mark.slow),
    ],
    ids=lambda value: f"{len(value)}" if isinstance(value, bytes) else "",
)  # fmt: skip
def test_reading_a_file_takes_little_more_memory_than_the_file(data, words):
    store = UploadStore()
    peak, found = memory_of(lambda: store.describe_file(store.add_file("x", data)))
    assert words in found
    assert peak < 20 * len(data) + 60 * 2**20


def test_a_compressed_record_is_refused_before_it_is_unpacked(monkeypatch):
    obspy = pytest.importorskip("obspy")
    packed, quiet = io.BytesIO(), np.zeros(400_000, dtype=np.int32)
    obspy.Stream([obspy.Trace(quiet)]).write(packed, format="MSEED", encoding="STEIM2", reclen=4096)
    store = UploadStore()
    key = store.add_file("x", packed.getvalue())
    assert len(store.describe_file(key)["channels"]) == 1
    monkeypatch.setattr(uploads, "_MAX_FILE_SAMPLES", 399_999)
    store.remove(key)
    key = store.add_file("x", packed.getvalue())
    peak, words = memory_of(lambda: store.describe_file(key))
    assert "400000 samples, of which at most 399999 are read here" in words
    assert peak < 2 * quiet.nbytes


@pytest.mark.parametrize(
    "path",
    [
        "/page/../server.py", "/page/..%2fserver.py", "/page/%2e%2e/server.py", "/page//etc/passwd",
        "/page/.", "/page/", "/page/main.js%00", "/page//evil.example/",
        "/page/index.html", "/page/standalone/index.html",
        "/page/standalone/../../server.py", "//etc/passwd", "/api/..%2f..%2fetc%2fpasswd", "/file:///etc/passwd",
    ],
)  # fmt: skip
def test_no_path_leads_anywhere_else(page, path):
    answer = page.get(path)
    assert answer.status_code in (404, 405, 422), answer.text
    assert "import" not in answer.text and "root:" not in answer.text


# Hostile


@pytest.mark.thorough
def test_twenty_clients_at_once_are_all_answered(page):
    def ask(k):
        answer = page.get("/api/case", params={**STATUE, "pga": f"{0.3 + 0.01 * k:.2f}g"})
        return unpacked(answer.content)[0]["motion"]["pga_g"]

    with ThreadPoolExecutor(20) as pool:
        found = list(pool.map(ask, range(20)))
    assert found == pytest.approx([0.3 + 0.01 * k for k in range(20)])


# Over a socket


@pytest.fixture(scope="module")
def running():
    here = Server(Explorer({"motion": "one-sine:amplitude=0.3g,frequency=1"}))
    here.run_in_background()
    yield here
    here.server.should_exit = True


@pytest.fixture(scope="module")
def browser(running):
    headers, _, _ = opened_by(running.create_link())
    with httpx.Client(headers=headers, timeout=60) as client:
        yield client


def test_the_server_answers_over_a_socket(running, browser):
    base = f"http://127.0.0.1:{running.port}"
    start = browser.get(f"{base}/api/start").json()
    assert start["opening"] == {"motion": "one-sine:amplitude=0.3g,frequency=1"}
    for path in ("/", "/page/main.js", "/api/start", "/api/nothing", "/api/case?p=x"):
        headers = browser.get(base + path).headers
        assert headers["x-content-type-options"] == "nosniff" and headers["cache-control"] == "no-cache"
        assert headers["referrer-policy"] == "no-referrer"


@pytest.mark.thorough
@pytest.mark.cases(fast=1, thorough=2)
@pytest.mark.parametrize(
    ("path", "axes"),
    [("map", {"x": "omega", "y": "a", "points": "400"}), ("sweep", {"sweep": "a", "sweep_points": "400"})],
)
def test_a_map_that_nobody_reads_any_more_stops(running, browser, path, axes):
    base = f"http://127.0.0.1:{running.port}"
    params = urlencode({**SINE, **axes})
    for _ in range(3):
        with browser.stream("GET", f"{base}/api/{path}?{params}") as answer:
            next(answer.iter_bytes())
    deadline = time.monotonic() + 120.0
    while time.monotonic() < deadline:
        busy = [thread for thread in threading.enumerate() if thread.name.startswith("ThreadPoolExecutor")]
        if not busy:
            break
        time.sleep(0.02)
    assert not busy
    assert browser.get(f"{base}/api/case", params=STATUE).status_code == 200


HEAD = b"HTTP/1.1\r\nHost: 127.0.0.1\r\n"
KNOWN = HEAD + b"Authorization: SECRET\r\n"
PACKED = KNOWN + b"Transfer-Encoding: chunked\r\n\r\n"
ATTACKS = [
    (b"GET /api/start " + HEAD + b"\r\n", 403),
    (b"GET /api/start " + KNOWN + b"\r\n", 200),
    (b"GET /api/start " + KNOWN + b"Authorization: Bearer x\r\n\r\n", 200),
    (b"GET /%61pi/start " + HEAD + b"\r\n", 403),
    (b"GET //api/start " + HEAD + b"\r\n", 404),
    (b"GET /page/../api/start " + HEAD + b"\r\n", 404),
    (b"GET /page/..%2f..%2fserver.py " + HEAD + b"\r\n", 404),
    (b"GET /page/%0d%0aset-cookie:a=b " + HEAD + b"\r\n", 404),
    (b"GET /api/export?form=svg%0d%0aset-cookie:a " + KNOWN + b"\r\n", 422),
    (b"POST /api/files?name=%0d%0aset-cookie:a " + KNOWN + b"Content-Length: 1\r\n\r\nx", 422),
    (b"POST /api/files?name=x " + KNOWN + b"Content-Length: 999999999\r\n\r\nx", 413),
    (b"POST /api/files?name=x " + PACKED + b"1\r\nx\r\n0\r\n\r\n", 422),
    (b"POST /api/start " + KNOWN + b"\r\n", 405),
    (b"TRACE /api/start " + KNOWN + b"\r\n", 405),
    (b"GET / HTTP/1.1\r\n\r\n", 400),
    (b"\x00\x01\x02\x03\r\n\r\n", 400),
]


@pytest.mark.parametrize(("raw", "status"), ATTACKS, ids=range(len(ATTACKS)))
def test_what_an_attacker_writes_is_answered_as_it_should_be(running, browser, raw, status):
    secret = browser.headers["authorization"].encode()
    with socket.create_connection(("127.0.0.1", running.port), timeout=10) as connection:
        connection.sendall(raw.replace(b"SECRET", secret))
        answer = connection.recv(4096)
    assert answer.startswith(b"HTTP/1.1 %d " % status), answer[:60]
    assert b"set-cookie" not in answer.partition(b"\r\n\r\n")[0].lower()


@pytest.mark.skipif(sys.platform != "linux", reason="only Linux lists the sockets of a process as files")
def test_nothing_listens_beyond_this_machine(running):
    own = set()
    for each in Path("/proc/self/fd").iterdir():
        with contextlib.suppress(OSError):  # another thread may have closed it meanwhile
            own.add(str(each.readlink()))
    found = []
    for family, here in (("tcp", "0100007F"), ("tcp6", "00000000000000000000000001000000")):
        for line in Path(f"/proc/self/net/{family}").read_text().splitlines()[1:]:
            _, local, _, state, *_, inode = line.split()[:10]
            if state == "0A" and f"socket:[{inode}]" in own:
                found.append((local.split(":")[0] == here, int(local.split(":")[1], 16)))
    assert (True, running.port) in found
    assert all(loopback for loopback, _ in found)


# The command


@pytest.mark.thorough
def test_the_command_prints_one_line_and_listens_here_alone():
    command = [sys.executable, "-c", "from rocking.cli import main; main()"]
    process = subprocess.Popen(
        [*command, "explore", "el-centro-meloland-270", "--no-open"],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, "PYTHONUNBUFFERED": "1"},
    )
    try:
        line = process.stdout.readline()
        link = re.search(r"http://127\.0\.0\.1:\d+/#token=[\w-]+", line)[0]
        headers, _, base = opened_by(link)
        with httpx.Client(headers=headers, timeout=60) as client:
            assert "rocking explorer" in client.get(base).text
            assert client.get(f"{base}/api/start").json()["opening"] == {"motion": "el-centro-meloland-270"}
        with pytest.raises(AssertionError, match="opens once"):
            opened_by(link)
    finally:
        process.send_signal(2)
        out, err = process.communicate(timeout=300)
    assert out == ""
    assert "Traceback" not in err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("nowhere.txt",), "there is no such file"),
        (("ridgecrest-cls-090",), "did you mean the shipped record ridgecrest-clc-090"),
        (("--port", "70000"), "from 0 to 65535"),
        (("tests",), "this folder contains no study; pass one record, and drop the other files on the page"),
        (("sine:amplitude=1",), "also requires frequency and cycles"),
    ],
)
def test_the_command_refuses_with_one_line(run, arguments, words, monkeypatch):
    monkeypatch.chdir(Path(__file__).parents[1])
    code, out, err = run("explore", "--no-open", *arguments)
    assert (code, out) == (2, "")
    assert words in err.splitlines()[-1]


def test_a_missing_package_is_named(run, monkeypatch):
    monkeypatch.setattr(launch.util, "find_spec", lambda name: None)
    code, _, err = run("explore", "--no-open")
    assert code == 2
    assert "pip install '.[explorer]' in the source folder" in err


def test_a_port_that_is_taken_is_said_so():
    here = Server(Explorer())
    try:
        with pytest.raises(OptionError, match="cannot be used"):
            Server(Explorer(), port=here.port)
    finally:
        here.socket.close()


# A study


def test_a_study_is_shown_and_a_point_of_it_opened(tmp_path, opened):
    blocks = rocking.Blocks.grid(p=np.linspace(2.0, 5.0, 4), alpha=np.linspace(0.1, 0.3, 5), restitution=[0.9])
    made = rocking.create_study(
        tmp_path / "museum",
        blocks,
        rocking.pulses.one_sine(1.0, 1.0),
        levels=[2.0, 4.0],
        measure="pga",
        blocks_per_batch=512,
    )
    with pytest.raises(StudyError, match="nothing of the study"):
        StudyView(tmp_path / "museum")
    made.run()
    browser = opened(App(Explorer({"view": "map"}, StudyView(tmp_path / "museum"))))
    assert [axis["name"] for axis in browser.get("/api/start").json()["study"]["axes"]] == ["p", "alpha", "scale"]
    header, arrays = unpacked(
        browser.get("/api/study", params={"x": "p", "y": "alpha", "quantity": "overturned"}).content
    )
    assert header["shape"] == [5, 4]
    assert set(arrays["values"]) <= {0.0, 1.0}
    point = {"x": "p", "y": "alpha", "at_x": "3", "at_y": "0.2", "scale_index": "1"}
    texts = browser.get("/api/study/point", params=point).json()
    header, _ = unpacked(browser.get("/api/case", params=texts).content)
    outcome = made.results().peak_rotation.sel(scale=4.0)
    chosen = np.flatnonzero((blocks.p[:, 0] == 3.0) & (blocks.alpha[:, 0] == 0.2))[0]
    assert header["peak_rotation"] == float(outcome.values.ravel()[chosen])
