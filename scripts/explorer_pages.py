"""Take the pictures of docs/howto/explorer.md: every view, two widths, light and dark; and a film of the block.

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
from playwright.sync_api import Page, sync_playwright

from rocking.explorer.core import Explorer
from rocking.explorer.launch import start_listening

IMAGES = Path(__file__).resolve().parents[1] / "docs" / "_static"

STATUE = "width=0.24&height=1.1&motion=ridgecrest-clc-090&pga=0.4g"
SINE = "width=0.24&height=1.1&motion=sine:amplitude%3D0.2247g,frequency%3D1.15,cycles%3D2.5"
#: Near an orbit of two periods; from rest the block overturns.
DOUBLED = (
    "width=0.24&height=1.1&restitution=0.5&motion=sine:amplitude%3D1.48g,frequency%3D2,cycles%3D10"
    "&initial_rotation=-0.0872&initial_velocity=1.06"
)
VIEWS = {
    "response": STATUE,
    "block": f"view=block&{STATUE}&from=230.6&to=236",
    "map": f"view=map&{SINE}",
    "periodic": f"view=periodic&{DOUBLED}",
    "compare": f"view=compare&{STATUE}",
}
WIDTHS = {"wide": (1280, 1000), "narrow": (390, 844)}
COLOURS = 96

#: Time in the film that passes in a second, and pictures a second.
FILM = f"view=block&{STATUE}&from=231.8&to=236.8"
FRAMES, RATE, SIZE = 120, 12, (720, 660)


def main() -> None:
    """Take all pictures, or those of the views that are named."""
    wanted = sys.argv[1:] or [*VIEWS, "film"]
    here = start_listening(Explorer(), {})
    here.run_in_background()
    flags = ["--disable-gpu", "--disable-background-networking", *(["--no-sandbox"] if os.geteuid() == 0 else [])]
    with sync_playwright() as player:
        browser = player.chromium.launch(executable_path=shutil.which("chromium"), args=flags)
        for scheme in ("light", "dark"):
            for width, (across, down) in WIDTHS.items():
                context = browser.new_context(viewport={"width": across, "height": down}, color_scheme=scheme)
                page = context.new_page()
                for view in set(VIEWS) & set(wanted):
                    visit(page, here.link(dict(parse_qsl(VIEWS[view]))), view)
                    save(Image.open(io.BytesIO(page.screenshot())), f"explorer-{view}-{width}-{scheme}.png")
                context.close()
        if "film" in wanted:
            page = browser.new_page(viewport={"width": 900, "height": 1000})
            visit(page, here.link(dict(parse_qsl(FILM))), "block")
            film(page)
        browser.close()


def visit(page: Page, link: str, view: str) -> None:
    """Open a view and wait until all of it is drawn."""
    page.goto(link)
    ready = {
        "map": "document.body.dataset.map === 'complete'",
        "periodic": "document.body.dataset.sweep === 'complete'",
        "compare": "document.body.dataset.compared",
    }
    wait(page, f"document.body.dataset.rested && {ready.get(view, 'true')}")
    if view == "block":
        scrub(page, 0.38)
    page.wait_for_timeout(700)


def wait(page: Page, condition: str) -> None:
    """Wait until a condition holds: the page's policy forbids the browser to wait by itself."""
    while not page.evaluate(f"Boolean({condition})"):
        time.sleep(0.05)


def scrub(page: Page, part: float) -> None:
    """Go to a part of the window's time."""
    page.evaluate(
        """(part) => {
          const scrub = document.getElementById('scrub');
          scrub.value = String(10000 * part);
          scrub.dispatchEvent(new Event('input'));
        }""",
        part,
    )
    wait(page, "Math.abs(stage.dataset.shown - parseFloat(clock.textContent)) < 0.01")


def film(page: Page) -> None:
    """Write ten seconds of the block and its plots: half as fast as it was."""
    frames = []
    for k in range(FRAMES):
        scrub(page, k / (FRAMES - 1))
        page.wait_for_timeout(60 if k else 1000)
        box = page.locator("#view-block").bounding_box()
        assert box is not None
        shown = page.screenshot(clip={"x": box["x"], "y": box["y"], "width": box["width"], "height": 860})
        frame = Image.open(io.BytesIO(shown)).convert("RGB")
        frames.append(frame.resize((SIZE[0], round(frame.height * SIZE[0] / frame.width)), Image.Resampling.LANCZOS))
    file = IMAGES / "explorer.webp"
    frames[0].save(
        file,
        save_all=True,
        append_images=frames[1:],
        duration=1000 // RATE,
        loop=0,
        quality=55,
        method=4,
        minimize_size=True,
    )
    sys.stdout.write(f"{file}: {file.stat().st_size // 1000} kB\n")


def save(image: Image.Image, name: str) -> None:
    """Write a picture with few colours: a page has no more."""
    file = IMAGES / name
    image.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE).save(file, optimize=True)
    sys.stdout.write(f"{file}: {file.stat().st_size // 1000} kB\n")


if __name__ == "__main__":
    main()
