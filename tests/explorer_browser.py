"""A headless browser for tests of the explorer's page: found, started, and watched for whatever it complains of."""

import json
import os
import shutil
import time
from contextlib import contextmanager
from pathlib import Path

import pytest

#: Set by `make browser`: then what is missing is a failure.
REQUIRED = "ROCKING_BROWSER_REQUIRED" in os.environ

#: Names that the program of the browser may have.
_PROGRAMS = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")

#: How many times slower than it is the processor of a page shall be.
SLOWDOWN = float(os.environ.get("ROCKING_BROWSER_SLOWDOWN", "1"))

#: Longest wait, s, below the time limit of a test, so that a failure names the expected state.
_MAX_WAIT = 150.0

_FLAGS = (
    "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync",
)  # fmt: skip


def missing(sentence):
    """Skip, or fail where the tests of the page are what was asked for."""
    if REQUIRED:
        pytest.fail(sentence)
    pytest.skip(sentence)


def program():
    """Path of the browser."""
    found = next(filter(None, map(shutil.which, _PROGRAMS)), None)
    return found or missing("no Chromium was found: install it (on Debian: apt install chromium)")


@contextmanager
def launched():
    """The browser, driven by Playwright."""
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        missing("playwright is not installed: pip install '.[browser]'")
    with sync_playwright() as player:
        started = player.chromium.launch(executable_path=program(), args=_chromium_flags())
        yield started
        started.close()


def _chromium_flags():
    """Flags of Chromium, which gives root no sandbox."""
    root = hasattr(os, "geteuid") and os.geteuid() == 0
    return [*_FLAGS, *(["--no-sandbox"] if root else [])]


def remembering(browser, folder):
    """Return a context, of a browser of its own, that keeps compiled scripts in a folder: pages open sooner."""
    return browser.browser_type.launch_persistent_context(folder, executable_path=program(), args=_chromium_flags())


def slowed(page):
    """Return a page whose processor is as slow as the tests are to find it, and which has time where it is busy."""
    page.set_default_timeout(60_000.0 * _busy())
    if SLOWDOWN > 1.0:
        page.context.new_cdp_session(page).send("Emulation.setCPUThrottlingRate", {"rate": SLOWDOWN})
    return page


def tool(path):
    """Path of a file of the front-end tools that `make browser` installs with npm."""
    file = Path(__file__).resolve().parents[1] / ".page-tools" / "node_modules" / path
    if not file.exists():
        sentence = f"{path} is not there: make browser installs it with npm"
        if shutil.which("npm") is None:
            pytest.skip(sentence)
        missing(sentence)
    return file


def _busy():
    """How many processes share a core, or 1, times how many times slower a page is."""
    return SLOWDOWN * max(1.0, os.getloadavg()[0] / (os.cpu_count() or 1)) if hasattr(os, "getloadavg") else SLOWDOWN


class Watched:
    """A page, and all that went wrong on it."""

    def __init__(self, page, allowed=()):
        self.page, self.allowed = page, allowed
        self.complaints, self.hosts = [], set()
        page.on("console", self._console)
        page.on("pageerror", lambda error: self.complaints.append(f"error: {error}"))
        page.on("request", lambda request: self.hosts.add(request.url.split("/")[2] if "//" in request.url else "data"))

    def _console(self, message):
        if message.type in ("error", "warning") and not any(text in message.text for text in self.allowed):
            self.complaints.append(f"{message.type}: {message.text}")

    def js(self, expression, *given):
        return self.page.evaluate(expression, *given)

    def paused(self, duration):
        """Wait for so many ms of the page's own time: what it does within these is done then, however slow it is."""
        self.page.evaluate("(duration) => new Promise((wake) => setTimeout(wake, duration))", duration)

    def until(self, expression, what="", timeout=60.0):
        """Wait until an expression holds; the page's policy forbids the browser to wait by itself.

        The time is that of a machine that does nothing else: where others wait for its cores, too, it is longer.
        """
        from playwright.sync_api import Error

        deadline, pause = time.monotonic() + min(timeout * _busy(), _MAX_WAIT), 0.02
        while time.monotonic() < deadline:
            try:
                found = self.page.evaluate(expression)
            except Error as error:  # the page is being loaded
                if "context was destroyed" not in str(error):
                    raise
                found = None
            if found:
                return found
            time.sleep(pause)
            pause = min(1.2 * pause, 0.2)  # each question takes time from what is waited for
        state = self.js("JSON.stringify(document.body.dataset)")
        raise AssertionError(f"not within {timeout:g} s: {what or expression}; {state}; {self.text('#problem')}")

    def text(self, selector):
        """Text of an element; where a number and its unit are kept on one line, there is a space between them."""
        return self.page.locator(selector).text_content().replace("\u00a0", " ")

    def says(self, name, words):
        """Wait until an element says so."""
        text = f"document.getElementById({name!r}).textContent.replaceAll('\\u00a0', ' ')"
        self.until(f"{text}.includes({json.dumps(words)})", f"#{name} says {words!r}")

    def rested(self, act):
        """Do something, and wait until all is drawn that follows from it."""
        before = self.js("Number(document.body.dataset.rested ?? 0)")
        act()
        self.until(f"Number(document.body.dataset.rested ?? 0) > {before}", "the page is drawn again")
