"""Who is let in: hosts, the one-time link, the cookie, and from which pages something may be sent."""

import itertools
from urllib.parse import parse_qs, urlsplit

import pytest
from explorer_client import Client, clients
from starlette.applications import Starlette
from starlette.responses import PlainTextResponse
from starlette.routing import Route

from rocking.explorer.authentication import LOOPBACK, RequestAuthentication

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
    """A browser that has opened the link."""
    browser = client(application)
    assert browser.get(f"/?token={application.new_token()}").status_code == 303
    return browser


def cookie_of(known):
    ((name, value),) = known.cookies.items()
    return f"{name}={value}"


def test_nothing_is_served_without_the_link(application, reached, client):
    for method, path in itertools.product(
        METHODS, ["/", "/page/main.js", "/api/case", "/library/bokeh.min.js", "/nothing"]
    ):
        answer = client(application).request(method, path, headers={"origin": OURS})
        assert answer.status_code == 403
        assert answer.headers["cache-control"] == "no-store"
    assert reached == []


def test_the_link_opens_once_and_keeps_what_else_it_says(application, reached, client):
    token = application.new_token()
    answer = client(application).get(f"/?view=map&p=2&token={token}&alpha=12deg")
    assert answer.status_code == 303
    assert answer.headers["location"] == "/?view=map&p=2&alpha=12deg"
    assert client(application).get(f"/?token={token}").status_code == 403
    assert client(application).get("/?token=").status_code == 403
    assert client(application).get("/?token=%C3%A9").status_code == 403
    assert reached == []


def test_the_cookie_is_for_this_server_alone(application, client):
    answer = client(application).get(f"/?token={application.new_token()}")
    cookie = answer.headers["set-cookie"]
    assert cookie.startswith(f"rocking-{PORT}=")
    assert cookie.endswith("; HttpOnly; SameSite=Strict; Path=/")


def test_whoever_has_the_cookie_is_let_in_and_a_spent_link_just_leads_on(application, known, reached):
    assert known.get("/").text == "inside"
    answer = known.get("/?token=spent&p=2")
    assert (answer.status_code, answer.headers["location"]) == (303, "/?p=2")
    assert "set-cookie" not in answer.headers
    assert reached == ["GET"]


@pytest.mark.parametrize("cookie", ["", "{}x", "x{}", "rocking-8123=", "rocking-8124={}", "{};{}", "ROCKING-8123=a"])
def test_another_cookie_does_not_do(application, known, cookie, reached, client):
    own = cookie_of(known)
    answer = client(application).get("/", headers={"cookie": cookie.replace("{}", own)})
    assert answer.status_code == 403
    assert reached == []


@pytest.mark.parametrize("host", LOOPBACK)
def test_the_machine_is_known_by_its_own_names(application, known, host, client):
    answer = client(application).get("/", headers={"host": f"{host}:{PORT}", "cookie": cookie_of(known)})
    assert answer.status_code == 200


@pytest.mark.parametrize(
    "host",
    [
        "evil.example",
        f"evil.example:{PORT}",
        "127.0.0.1",
        "127.0.0.1:80",
        f"127.0.0.1.evil.example:{PORT}",
        f"localhost.:{PORT}",
        f"127.0.0.2:{PORT}",
        f"[::1%25lo]:{PORT}",
        f"127.0.0.1:{PORT}@evil.example",
        f" 127.0.0.1:{PORT}x",
        f"127.0.0.1:{PORT},evil",
        f"LOCALHOST:{PORT}",
        "",
    ],
)
@pytest.mark.parametrize("method", ["GET", "POST", "OPTIONS"])
def test_a_rebound_name_is_misdirected_even_with_cookie_and_matching_origin(
    application, known, host, method, reached, client
):
    headers = {"host": host, "origin": f"http://{host}", "cookie": cookie_of(known), "sec-fetch-site": "same-origin"}
    assert client(application).request(method, "/api/case", headers=headers).status_code == 421
    assert reached == []


@pytest.mark.parametrize("hosts", [[], [b"127.0.0.1:8123", b"127.0.0.1:8123"], [b"127.0.0.1:8123", b"evil.example"]])
@pytest.mark.anyio
async def test_one_host_header_and_no_other_number_of_them(application, hosts, reached):
    sent = []

    async def send(message):
        sent.append(message)

    scope = {
        "type": "http",
        "method": "GET",
        "path": "/",
        "query_string": b"",
        "headers": [(b"host", host) for host in hosts],
    }
    await application(scope, None, send)
    assert sent[0]["status"] == 421
    assert reached == []


@pytest.fixture
def anyio_backend():
    return "asyncio"


SENDING = ["POST", "PUT", "DELETE", "PATCH", "OPTIONS", "TRACE"]


@pytest.mark.parametrize("method", SENDING)
@pytest.mark.parametrize(
    "headers",
    [
        {},
        {"origin": "null"},
        {"origin": "http://evil.example"},
        {"origin": f"https://127.0.0.1:{PORT}"},
        {"origin": "http://127.0.0.1:9999"},
        {"origin": f"http://localhost:{PORT}"},
        {"origin": "http://evil.example", "sec-fetch-site": "same-origin"},
        {"sec-fetch-site": "same-site"},
        {"sec-fetch-site": "cross-site"},
        {"sec-fetch-site": "none"},
    ],
)
def test_only_our_own_page_may_send(known, method, headers, reached):
    assert known.request(method, "/api/records", headers=headers).status_code == 403
    assert reached == []


@pytest.mark.parametrize(
    "headers", [{"origin": OURS}, {"sec-fetch-site": "same-origin"}, {"origin": OURS, "sec-fetch-site": "same-origin"}]
)
def test_our_own_page_may_send(known, headers):
    assert known.post("/api/records", headers=headers).status_code == 200


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"sec-fetch-site": "same-origin", "sec-fetch-mode": "cors"}, 200),
        ({"sec-fetch-site": "none", "sec-fetch-mode": "navigate"}, 200),
        ({"sec-fetch-site": "cross-site", "sec-fetch-mode": "navigate"}, 200),
        ({"sec-fetch-site": "same-site", "sec-fetch-mode": "no-cors"}, 403),
        ({"sec-fetch-site": "cross-site", "sec-fetch-mode": "no-cors"}, 403),
        ({"origin": "http://localhost:8888", "sec-fetch-site": "same-site", "sec-fetch-mode": "cors"}, 403),
    ],
)
def test_other_pages_may_link_here_but_load_nothing(known, headers, status):
    assert known.get("/api/case", headers=headers).status_code == status


@pytest.mark.anyio
async def test_no_websocket_is_accepted(application):
    sent = []

    async def send(message):
        sent.append(message)

    await application({"type": "websocket", "path": "/", "headers": [(b"host", b"127.0.0.1:8123")]}, None, send)
    assert sent == [{"type": "websocket.close", "code": 1008}]


def test_links_that_nobody_opened_are_forgotten_in_the_end(application, client):
    first = application.new_token()
    for _ in range(150):
        application.new_token()
    assert client(application).get(f"/?token={first}").status_code == 403
    assert len(application._tokens) == 100


def test_the_printed_link_has_a_token_of_its_own():
    from rocking.explorer.core import Explorer
    from rocking.explorer.launch import served

    here = served(Explorer(), {})
    try:
        first, second = (parse_qs(urlsplit(here.link({"p": "2"})).query) for _ in range(2))
        assert first["p"] == ["2"]
        assert len(first["token"][0]) > 40
        assert first["token"] != second["token"]
        assert here.socket.getsockname()[0] == "127.0.0.1"
    finally:
        here.socket.close()
