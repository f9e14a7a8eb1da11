"""How soon the explorer's page answers: a slider to its drawn response, a page until it is ready, a map.

    python benchmarks/bench_explorer.py

Needs the extras `explorer` and `browser`, and Chromium; without them it says so and ends.
"""

import os
import shutil
import statistics
import time
from urllib.parse import parse_qsl, urlsplit

import httpx

from rocking.explorer.core import Explorer
from rocking.explorer.launch import Server
from rocking.explorer.server import EXCHANGE

CASE = "width=0.24&height=1.1&motion=ridgecrest-clc-090&pga=0.4g"
SINE = "view=map&width=0.24&height=1.1&motion=sine:amplitude%3D0.2247g,frequency%3D1.15,cycles%3D2.5"
SLIDE = """async (count) => {
  const slider = document.getElementById('width-slider'), took = [];
  const frame = () => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
  for (let k = 0; k < count; k += 1) {
    const before = document.body.dataset.drawn, start = performance.now();
    slider.value = String(400 + (k % 60) * 3);
    slider.dispatchEvent(new Event('input', {bubbles: true}));
    while (document.body.dataset.drawn === before) await new Promise((done) => setTimeout(done, 0));
    await frame();
    took.push(performance.now() - start);
    await new Promise((done) => setTimeout(done, 50));
  }
  return took;
}"""
MAP = "[Number(document.body.dataset.first), Number(document.body.dataset.mapTook)]"


def main():
    try:
        from playwright.sync_api import sync_playwright
    except ImportError:
        print("no browser: pip install '.[browser]'")
        return
    if shutil.which("chromium") is None:
        print("no browser: install Chromium")
        return
    here = Server(Explorer())
    here.run_in_background()
    flags = ["--disable-gpu", "--disable-background-networking", *(["--no-sandbox"] if os.geteuid() == 0 else [])]
    with sync_playwright() as player:
        browser = player.chromium.launch(executable_path=shutil.which("chromium"), args=flags)
        page = browser.new_page(viewport={"width": 1280, "height": 900})
        page.goto(here.create_link(dict(parse_qsl(CASE))))
        wait(page, "document.body.dataset.rested")
        ready = []
        for _ in range(5):
            page.reload()
            wait(page, "document.body.dataset.drawn")
            ready.append(page.evaluate("Number(document.body.dataset.ready)"))
        print(f"page ready: {statistics.median(ready):.0f} ms (median of 5)")
        report("slider to drawn response, 320 s record", page.evaluate(SLIDE, 60))
        mapped = browser.new_page(viewport={"width": 1280, "height": 900})
        mapped.goto(here.create_link(dict(parse_qsl(SINE))))
        wait(mapped, "document.body.dataset.first")
        report("  while a map is computed", page.evaluate(SLIDE, 40))
        if mapped.evaluate("document.body.dataset.map") == "complete":
            print("  (the map was complete before the last of them)")
        wait(mapped, "document.body.dataset.map === 'complete'")
        mapped.reload()
        wait(mapped, "document.body.dataset.map === 'complete'")
        first, whole = mapped.evaluate(MAP)
        print(f"map of 200 x 200 points: first picture {first:.0f} ms, complete {1e-3 * whole:.1f} s")
        took = time.process_time()
        mapped.goto(here.create_link(dict(parse_qsl(f"view=map&{CASE}"))))
        wait(mapped, "document.body.dataset.map === 'complete'")
        first, whole = mapped.evaluate(MAP)
        took = time.process_time() - took
        print(
            f"the same of a record: {first:.0f} ms, complete {1e-3 * whole:.1f} s; {took:.1f} s of processor time here"
        )
        browser.close()
    print(f"case from the server alone: {server_alone(here):.1f} ms (median of 50)")
    print(f"load average {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")


def server_alone(here):
    """Median time, ms, of a new case over the socket."""
    took = []
    base = f"http://127.0.0.1:{here.port}"
    with httpx.Client(base_url=base, headers={"origin": base}, timeout=60) as client:
        token = urlsplit(here.create_link()).fragment.removeprefix("token=")
        answer = client.post(EXCHANGE, headers={"authorization": f"Bearer {token}"}).raise_for_status()
        client.headers["authorization"] = f"Bearer {answer.text}"
        for k in range(50):
            start = time.perf_counter()
            client.get(f"/api/case?{CASE.replace('0.4g', f'{0.4 + 1e-4 * k:.4f}g')}").raise_for_status()
            took.append(1e3 * (time.perf_counter() - start))
    return statistics.median(took)


def report(what, took):
    print(f"{what}: median {statistics.median(took):.0f} ms, 90 % below {statistics.quantiles(took, n=10)[-1]:.0f} ms")


def wait(page, condition):
    while not page.evaluate(f"Promise.resolve({condition}).then(Boolean)"):
        time.sleep(0.05)


if __name__ == "__main__":
    main()
