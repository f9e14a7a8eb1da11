"""Headless Chromium for tests of the explorer's page: found, started, and watched for whatever it complains of."""

import os
import shutil
import time
from pathlib import Path

import pytest

#: Set by `make browser`: then what is missing is a failure.
REQUIRED = "ROCKING_BROWSER_REQUIRED" in os.environ

_FLAGS = (
    "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking",
    "--disable-component-update", "--disable-sync",
)  # fmt: skip


def missing(sentence):
    """Skip, or fail where the tests of the page are what was asked for."""
    if REQUIRED:
        pytest.fail(sentence)
    pytest.skip(sentence)


def chromium():
    """Path of the browser."""
    for name in ("chromium", "chromium-browser", "google-chrome"):
        found = shutil.which(name)
        if found:
            return found
    return missing("no Chromium was found: install it (on Debian: apt install chromium)")


def flags():
    """Arguments of the browser; root has no sandbox."""
    return [*_FLAGS, *(["--no-sandbox"] if hasattr(os, "geteuid") and os.geteuid() == 0 else [])]


def tool(path):
    """Path of a file of the front-end tools that `make browser` installs with npm."""
    file = Path(__file__).resolve().parents[1] / ".page-tools" / "node_modules" / path
    if not file.exists():
        sentence = f"{path} is not there: make browser installs it with npm"
        if shutil.which("npm") is None:
            pytest.skip(sentence)
        missing(sentence)
    return file


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

    def until(self, expression, what="", timeout=60.0):
        """Wait until an expression holds; the page's policy forbids the browser to wait by itself."""
        deadline = time.monotonic() + timeout
        while time.monotonic() < deadline:
            found = self.page.evaluate(expression)
            if found:
                return found
            time.sleep(0.03)
        raise AssertionError(f"not within {timeout:g} s: {what or expression}; {self.text('#problem')}")

    def text(self, selector):
        return self.page.locator(selector).text_content()

    def rested(self, act):
        """Do something, and wait until all is drawn that follows from it."""
        before = self.js("Number(document.body.dataset.rested ?? 0)")
        act()
        self.until(f"Number(document.body.dataset.rested ?? 0) > {before}", "the page is drawn again")
