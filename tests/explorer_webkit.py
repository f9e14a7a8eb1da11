"""The WebKit that a distribution brings (WebKitGTK), on a screen of its own, driven over W3C WebDriver."""

import os
import shutil
import socket
import subprocess
import time
from contextlib import contextmanager
from pathlib import Path

import httpx
from explorer_browser import missing, program

_FOLDERS = ("/usr/lib", "/usr/lib64", "/usr/libexec")
#: The page's policy admits no code from texts; what is asked of the page is evaluated outside of it.
_SCRIPT = (
    "const done = arguments[arguments.length - 1]; Promise.resolve((%s)).then(done, (no) => done(`failed: ${no}`))"
)


class WebKit:
    """One window, and what went wrong on its page since it was opened."""

    def __init__(self, client, session):
        self.client, self.session = client, f"/session/{session}"

    def call(self, path, **given):
        answer = self.client.post(self.session + path, json=given).json()["value"]
        assert not (isinstance(answer, dict) and "error" in answer), answer
        return answer

    def open(self, link):
        self.call("/url", url=link)
        self.until("document.body.dataset.ready && document.body.dataset.rested", "the page is ready")
        self.js("""(() => {
          window.complaints = [];
          for (const name of ['error', 'warn'])
            console[name] = (...words) => { window.complaints.push(words.join(' ')); };
          for (const name of ['error', 'unhandledrejection', 'securitypolicyviolation'])
            window.addEventListener(name, (event) => { window.complaints.push(`${name}: ${event.message ?? ''}`); });
        })()""")

    def js(self, expression):
        return self.call("/execute/async", script=_SCRIPT % expression, args=[])

    def until(self, expression, what="", timeout=60.0):
        deadline = time.monotonic() + timeout
        while time.monotonic() < deadline:
            found = self.js(expression)
            if found:
                return found
            time.sleep(0.05)
        raise AssertionError(f"not within {timeout:g} s: {what or expression}; {self.text('problem')}")

    def text(self, name):
        return self.js(f"document.getElementById({name!r}).textContent").replace("\u00a0", " ")

    def click(self, selector):
        self.js(f"document.querySelector({selector!r}).click()")


@contextmanager
def windows():
    """Open a window, and close it with its driver and its screen."""
    driver, browser = program(), None
    for folder in _FOLDERS:
        browser = browser or next(Path(folder).glob("**/MiniBrowser"), None)
    screen = shutil.which("Xvfb") or missing("no Xvfb was found: install it (on Debian: apt install xvfb)")
    if browser is None:
        missing("no MiniBrowser was found: it comes with WebKitWebDriver (on Debian: apt install webkit2gtk-driver)")
    reading, writing = os.pipe()
    words = [screen, "-displayfd", str(writing), "-screen", "0", "1400x1000x24", "-nolisten", "tcp"]
    with subprocess.Popen(words, pass_fds=[writing], stderr=subprocess.DEVNULL) as shown:
        os.close(writing)
        with os.fdopen(reading) as said:
            display = f":{said.readline().strip()}"
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        around = {**os.environ, "DISPLAY": display, "GDK_BACKEND": "x11", "LIBGL_ALWAYS_SOFTWARE": "1"}
        with subprocess.Popen([driver, "--host=127.0.0.1", f"--port={port}"], env=around) as driving:
            try:
                with httpx.Client(base_url=f"http://127.0.0.1:{port}", timeout=120) as client:
                    window = _begun(client, browser)
                    yield window
                    client.delete(window.session)
            finally:
                driving.terminate()
                shown.terminate()


def _begun(client, browser):
    for _ in range(100):
        try:
            client.get("/status")
            break
        except httpx.HTTPError:
            time.sleep(0.1)
    options = {"webkitgtk:browserOptions": {"binary": str(browser), "args": ["--automation"]}}
    answer = client.post("/session", json={"capabilities": {"alwaysMatch": options}}).json()["value"]
    assert "sessionId" in answer, answer
    return WebKit(client, answer["sessionId"])
