"""Take the pictures of docs/howto/explorer.md: the response and a map.

Run ``python scripts/explorer_pages.py`` from the repository's root; it needs the extras `explorer` and `browser`, and
Chromium.
"""

from __future__ import annotations

import io
import os
import shutil
import sys
import time
from pathlib import Path
from urllib.parse import parse_qsl

from PIL import Image
from playwright.sync_api import sync_playwright

from rocking.explorer.core import Explorer
from rocking.explorer.launch import Server

IMAGES = Path(__file__).resolve().parents[1] / "docs" / "_static"

STATUE = "width=0.24&height=1.1&motion=ridgecrest-clc-090&pga=0.4g"
SINE = "width=0.24&height=1.1&motion=sine:amplitude%3D0.2247g,frequency%3D1.15,cycles%3D2.5"
#: Queries of the views, and what holds once all is drawn.
VIEWS = {
    "shake": (f"{STATUE}&at=232.69", "rested"),
    "map": (f"{SINE}&view=map", "map === 'complete'"),
}
COLOURS = 96


def main() -> None:
    """Take all pictures, or those of the views that are named."""
    wanted = sys.argv[1:] or [*VIEWS]
    here = Server(Explorer())
    here.run_in_background()
    flags = ["--disable-gpu", "--disable-background-networking", *(["--no-sandbox"] if os.geteuid() == 0 else [])]
    with sync_playwright() as player:
        browser = player.chromium.launch(executable_path=shutil.which("chromium"), args=flags)
        page = browser.new_page(viewport={"width": 1280, "height": 1000})
        for view in wanted:
            query, ready = VIEWS[view]
            page.goto(here.create_link(dict(parse_qsl(query))))
            while not page.evaluate(f"Boolean(document.body.dataset.{ready})"):
                time.sleep(0.05)
            page.wait_for_timeout(700)
            save(Image.open(io.BytesIO(page.screenshot())), f"explorer-{view}.png")
        browser.close()


def save(image: Image.Image, name: str) -> None:
    """Write a picture with few colours: a page has no more."""
    file = IMAGES / name
    image.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE).save(file, optimize=True)
    sys.stdout.write(f"{file}: {file.stat().st_size // 1000} kB\n")


if __name__ == "__main__":
    main()
