"""Who is let in: hosts, the one-time link, the secret, and from which pages something may be read or sent."""

import itertools
import sys
from urllib.parse import parse_qs, urlsplit

import pytest
from explorer_client import Client, bearing, clients, let_in
from starlette.applications import Starlette
from starlette.responses import PlainTextResponse
from starlette.routing import Route

from rocking.explorer.authentication import EXCHANGE, LOOPBACK, RequestAuthentication
from rocking.explorer.core import Explorer
from rocking.explorer.launch import start_listening
from rocking.explorer.server import App

PORT = 8123
OURS = f"http://127.0.0.1:{PORT}"
METHODS = ["GET", "HEAD", "POST", "PUT", "DELETE", "OPTIONS", "PATCH", "TRACE", "PROPFIND"]


@pytest.fixture
def reached():
    return []


@pytest.fixture
def application(reached):
    async def answer(request):
        reached.append(request.method)
        return PlainTextResponse("inside")

    routes = [Route("/", answer, methods=METHODS), Route("/{rest:path}", answer, methods=METHODS)]
    return RequestAuthentication(Starlette(routes=routes), PORT)


@pytest.fixture(scope="module")
def client():
    """Make browsers that know nothing yet."""
    with clients() as portal:
        yield lambda application: Client(portal, application, OURS)


@pytest.fixture
def known(application, client):
    """A page that has the secret."""
    page = let_in(client(application), application.new_token())
    del page.headers["sec-fetch-site"]
    return page


def secret_of(known):
    return known.headers["authorization"].removeprefix("Bearer ")


# Every request


def answered(application, method, path, headers):
    """Status of a request that goes straight to an application, and its body."""
    sent = []
    scope = {"type": "http", "method": method, "path": path, "query_string": b"", "headers": headers}

    async def send(message):
        sent.append(message)

    call = application(scope, None, send)
    with pytest.raises(StopIteration):
        call.send(None)
    return sent[0]["status"], sent[1]["body"].decode()


def as_specified(method, path, host, origin, carried, reads_files):
    """What a request is answered with, case by case."""
    if host not in ("127.0.0.1:8123", "localhost:8123", "[::1]:8123"):
        return 421
    if origin not in (None, f"http://{host}"):
        return 403
    if origin is None and method not in ("GET", "HEAD"):
        return 403
    if method == "POST" and path == "/api/secret":
        return {"Bearer TOKEN": 200}.get(carried, 403)
    if reads_files and method in ("GET", "HEAD"):
        return 200
    return 200 if carried == "Bearer SECRET" else 403


HOSTS = ["127.0.0.1:8123", "localhost:8123", "evil.example:8123", "127.0.0.1:8124"]
ORIGINS = [None, OURS, "http://localhost:8123", "null", "http://127.0.0.1:8124"]
CARRIED = [None, "Bearer SECRET", "Bearer TOKEN", "Bearer ", "Basic SECRET"]


def test_every_request_is_answered_as_specified():
    inside = []

    async def reach(scope, _, send):
        inside.append(scope["path"])
        await send({"type": "http.response.start", "status": 200, "headers": []})
        await send({"type": "http.response.body", "body": b"inside"})

    application = RequestAuthentication(reach, PORT)
    _, secret = answered(
        application,
        "POST",
        EXCHANGE,
        [
            (b"host", b"127.0.0.1:8123"),
            (b"origin", OURS.encode()),
            (b"authorization", f"Bearer {application.new_token()}".encode()),
        ],
    )
    files = {"/", "/block", "/page/{name}", "/library/{name}"}
    routes = [route.path for route in App(Explorer(), {}).asgi.routes]
    assert files < {*routes}
    paths = [*routes, EXCHANGE, "/api", "//api/start", "/pages/x", "/page", "http://127.0.0.1:8123/"]
    judged, let = 0, 0
    cases = itertools.product(["GET", "HEAD", "POST", "DELETE", "OPTIONS"], paths, HOSTS, ORIGINS, CARRIED)
    for method, path, host, origin, carried in cases:
        headers = [(b"host", host.encode())] + ([] if origin is None else [(b"origin", origin.encode())])
        if carried is not None:
            token = application.new_token() if "TOKEN" in carried else ""
            headers.append((b"authorization", carried.replace("SECRET", secret).replace("TOKEN", token).encode()))
        inside.clear()
        status, body = answered(application, method, path, headers)
        expected = as_specified(method, path, host, origin, carried, path in files)
        assert status == expected, (method, path, host, origin, carried)
        goes_on = status == 200 and not (method == "POST" and path == EXCHANGE)
        assert inside == ([path] if goes_on else []), (method, path, host, origin, carried)
        assert (secret in body) == (status == 200 and not goes_on)
        judged, let = judged + 1, let + (status == 200)
    assert judged >= 12_000 and let >= 500


# The link


def test_the_page_says_nothing_of_what_is_shown(client):
    case = {"motion": "one-sine:amplitude=0.31g,frequency=1"}
    application = RequestAuthentication(App(Explorer(), case).asgi, PORT)
    stranger = client(application)
    assert "amplitude=0.31g" not in stranger.get("/").text
    assert stranger.get("/api/start").status_code == 403
    known = let_in(stranger, application.new_token())
    assert known.get("/api/start").json()["opening"] == case


@pytest.mark.parametrize("token", ["", "é", "x" * 43, "x" * 100_000])
def test_a_token_is_exchanged_once(application, client, token):
    good, headers = application.new_token(), {"origin": OURS}
    first, second, other = (
        client(application).post(EXCHANGE, headers={**headers, "authorization": f"Bearer {each}".encode()})
        for each in (good, good, token)
    )
    assert (first.status_code, second.status_code, other.status_code) == (200, 403, 403)
    assert len(first.text) >= 40 and first.text != good
    assert first.headers["cache-control"] == "no-store"


def test_no_cookie_is_set_or_asked_for(application, known, client):
    token = application.new_token()
    answer = client(application).post(EXCHANGE, headers={"origin": OURS, **bearing(token)})
    assert "set-cookie" not in answer.headers
    secret = secret_of(known)
    for cookie in (f"rocking-{PORT}={secret}", secret, f"authorization=Bearer {secret}"):
        assert client(application).get("/api/start", headers={"cookie": cookie}).status_code == 403


@pytest.mark.parametrize(
    "carried",
    [
        "",
        "{}",
        "Bearer",
        "Bearer  {}",
        "Bearer {} ",
        "Bearer {}x",
        "Bearer x{}",
        "bearer {}",
        "Basic {}",
        "Bearer {},{}",
    ],
)
def test_another_secret_does_not_do(application, known, carried, reached, client):
    headers = [(b"host", b"127.0.0.1:8123"), (b"authorization", carried.replace("{}", secret_of(known)).encode())]
    assert answered(application, "GET", "/api/start", headers)[0] == 403
    assert reached == []


def test_one_secret_and_no_other_number_of_them(application, known):
    host, carried = (b"host", b"127.0.0.1:8123"), (b"authorization", known.headers["authorization"].encode())
    assert answered(application, "GET", "/api/start", [host, carried, carried])[0] == 403
    assert known.get("/api/start").status_code == 200


def test_links_that_nobody_opened_are_forgotten_in_the_end(application, client):
    first = application.new_token()
    for _ in range(150):
        application.new_token()
    answer = client(application).post(EXCHANGE, headers={"origin": OURS, **bearing(first)})
    assert answer.status_code == 403
    assert len(application._tokens) == 100


def test_the_printed_link_has_a_token_of_its_own_where_no_browser_sends_it():
    here = start_listening(Explorer(), {})
    try:
        first, second = (urlsplit(here.link({"p": "2"})) for _ in range(2))
        assert first.query == second.query == "p=2"
        assert len(parse_qs(first.fragment)["token"][0]) > 40
        assert first.fragment != second.fragment
        assert here.socket.getsockname()[0] == "127.0.0.1"
    finally:
        here.socket.close()


# Names


@pytest.mark.parametrize(
    ("port", "hosts", "sent", "status"),
    [
        (80, ("127.0.0.1",), "127.0.0.1", 200),
        (80, ("127.0.0.1",), "127.0.0.1:80", 200),
        (PORT, ("127.0.0.1",), "127.0.0.1", 421),
        (PORT, ("MyPC",), f"mypc:{PORT}", 200),
        (80, ("MyPC",), "mypc", 200),
    ],
)
def test_a_server_is_known_by_its_name_as_browsers_send_it(port, hosts, sent, status):
    async def inside(scope, receive, send):
        await PlainTextResponse("inside")(scope, receive, send)

    application = RequestAuthentication(inside, port, hosts)
    headers = [(b"host", sent.encode()), (b"origin", f"http://{sent}".encode())]
    assert answered(application, "GET", "/", headers)[0] == status


@pytest.mark.skipif(sys.platform == "darwin", reason="macOS has one address of this machine alone")
def test_an_address_is_known_as_a_browser_writes_it(capsys):
    here = start_listening(Explorer(), {}, address="127.2")
    try:
        assert here.socket.getsockname()[0] == "127.0.0.2" and capsys.readouterr().err == ""
        names = here.authentication._hosts
        assert {f"{host}:{here.port}".encode() for host in ("127.2", "127.0.0.2")} <= names
    finally:
        here.socket.close()


@pytest.mark.parametrize("host", LOOPBACK)
def test_the_machine_is_known_by_its_own_names(known, host):
    assert known.get("/api/start", headers={"host": f"{host}:{PORT}"}).status_code == 200


HOSTS_OF_OTHERS = [
    "evil.example", f"evil.example:{PORT}", "127.0.0.1", "127.0.0.1:80", f"127.0.0.1.evil.example:{PORT}",
    f"localhost.:{PORT}", f"127.0.0.2:{PORT}", f"[::1%25lo]:{PORT}", f"127.0.0.1:{PORT}@evil.example",
    f" 127.0.0.1:{PORT}x", f"127.0.0.1:{PORT},evil", f"LOCALHOST:{PORT}", "",
]  # fmt: skip


@pytest.mark.parametrize("method", ["GET", "POST", "OPTIONS"])
def test_a_rebound_name_is_misdirected_even_with_secret_and_matching_origin(known, method, reached):
    for host in HOSTS_OF_OTHERS:
        headers = {"host": host, "origin": f"http://{host}", "sec-fetch-site": "same-origin"}
        assert known.request(method, "/api/case", headers=headers).status_code == 421, host
    assert reached == []


@pytest.mark.parametrize("hosts", [[], [b"127.0.0.1:8123", b"127.0.0.1:8123"], [b"127.0.0.1:8123", b"evil.example"]])
def test_one_host_header_and_no_other_number_of_them(application, hosts, reached):
    assert answered(application, "GET", "/", [(b"host", host) for host in hosts])[0] == 421
    assert reached == []


# Other pages


@pytest.mark.parametrize(
    "headers",
    [
        {},
        {"origin": "null"},
        {"origin": f"https://127.0.0.1:{PORT}"},
        {"origin": "http://evil.example", "sec-fetch-site": "same-origin"},
        {"sec-fetch-site": "same-site"},
        {"sec-fetch-site": "cross-site"},
        {"sec-fetch-site": "none"},
    ],
)
def test_only_our_own_page_may_send(known, headers, reached):
    for method in ("POST", "PUT", "DELETE", "PATCH", "OPTIONS", "TRACE"):
        assert known.request(method, "/api/records", headers=headers).status_code == 403, method
    assert reached == []
    for ours in ({"origin": OURS}, {"sec-fetch-site": "same-origin"}):
        assert known.post("/api/records", headers=ours).status_code == 200


@pytest.mark.parametrize("path", ["/", "/page/main.js", "/api/case"])
@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"sec-fetch-site": "same-origin", "sec-fetch-mode": "cors"}, 200),
        ({"sec-fetch-site": "none", "sec-fetch-mode": "navigate"}, 200),
        ({"sec-fetch-site": "cross-site", "sec-fetch-mode": "navigate"}, 200),
        ({"sec-fetch-site": "same-site", "sec-fetch-mode": "no-cors"}, 403),
        ({"sec-fetch-site": "cross-site", "sec-fetch-mode": "no-cors"}, 403),
        ({"origin": "http://localhost:8888", "sec-fetch-site": "same-site", "sec-fetch-mode": "cors"}, 403),
        ({"origin": "null"}, 403),
        ({"origin": "null", "sec-fetch-site": "cross-site", "sec-fetch-mode": "navigate"}, 403),
        ({"origin": "http://evil.example", "sec-fetch-mode": "navigate"}, 403),
    ],
)
def test_other_pages_may_link_here_but_load_nothing(known, headers, status, path):
    assert known.get(path, headers=headers).status_code == status


def test_no_websocket_is_accepted(application):
    sent = []

    async def send(message):
        sent.append(message)

    call = application({"type": "websocket", "path": "/", "headers": [(b"host", b"127.0.0.1:8123")]}, None, send)
    with pytest.raises(StopIteration):
        call.send(None)
    assert sent == [{"type": "websocket.close", "code": 1008}]


def test_the_start_and_the_end_of_the_server_are_passed_on():
    """They come from the server itself, and carry no headers."""
    reached = []

    async def application(scope, receive, send):
        reached.append(scope["type"])

    with pytest.raises(StopIteration):
        RequestAuthentication(application, PORT)({"type": "lifespan"}, None, None).send(None)
    assert reached == ["lifespan"]
