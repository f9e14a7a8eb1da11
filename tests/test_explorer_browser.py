"""The explorer's page in a browser: every tab, every way in and out, against the package's own numbers."""

import http.server
import io
import json
import math
import random
import re
import runpy
import shlex
import subprocess
import threading
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import parse_qs, parse_qsl, urlencode

import explorer_addresses
import numpy as np
import pytest
import trimesh
from explorer_answers import page_answer
from explorer_browser import Watched, launched, slowed, tool
from PIL import Image

import rocking
from rocking.explorer import maps
from rocking.explorer.core import Explorer
from rocking.explorer.inputs import read_case
from rocking.explorer.launch import Server
from rocking.explorer.studies import StudyView
from rocking.explorer.uploads import UploadStore

pytestmark = pytest.mark.browser

STATUE = "width=0.24&height=1.1&motion=ridgecrest-clc-090&pga=0.4g"
SINE = "p=2&alpha=0.2&restitution=0.92&motion=sine:amplitude%3D2.02,frequency%3D0.6366197723675814,cycles%3D2.5"
DESK, PHONE = {"width": 1280, "height": 900}, {"width": 390, "height": 844}
RECORDS = "%3B".join(f"motion%3D{name}" for name in ("el-centro-meloland-270", "ridgecrest-clc-360"))
MORE = pytest.mark.thorough
READY = "document.body?.dataset.ready && document.body.dataset.rested"
MARKED = "Array.from(document.querySelectorAll('[aria-invalid=true]'), (each) => each.id)"
STALE = "document.getElementById('main').classList.contains('stale')"
#: What holds when a view has computed all that it shows.
COMPUTED = {
    "shake": READY,
    "map": "document.body.dataset.map === 'complete'",
    "periodic": "document.body.dataset.sweep === 'complete'",
    "assess": "document.body.dataset.assessment === 'complete'",
}


@pytest.fixture(scope="module")
def browser():
    with launched() as started:
        yield started


@pytest.fixture(scope="module")
def explorer():
    return Explorer()


@pytest.fixture(scope="module")
def here(explorer):
    running = Server(explorer)
    running.run_in_background()
    yield running
    running.server.should_exit = True


@pytest.fixture
def opened(browser, here):
    """Open the page with a query; in the end nothing may have gone wrong on it."""
    pages = []

    def open_page(query="", viewport=DESK, scheme="light", server=here, allowed=(), **options):
        context = browser.new_context(viewport=viewport, color_scheme=scheme, **options)
        page = Watched(slowed(context.new_page()), allowed)
        pages.append((page, server, context))
        page.page.goto(server.create_link(dict(parse_qsl(query))))
        page.until(READY, "the page is ready")
        return page

    yield open_page
    for page, server, context in pages:
        context.close()
        assert page.complaints == []
        assert page.hosts <= {f"127.0.0.1:{server.port}", "data", ""}


def query_of(page):
    page.paused(300)
    return {name: values[0] for name, values in parse_qs(page.js("location.search.slice(1)")).items()}


def statue(level="0.4g"):
    return read_case({**dict(parse_qsl(STATUE)), "pga": level}, UploadStore()).simulate()


def as_number(text):
    return float(text.replace("−", "-").replace("\u00a0", " ").split(" ")[0])


def fill(page, name, text):
    page.page.fill(f"#{name}", text)
    page.page.press(f"#{name}", "Enter")


# Shake


def test_the_first_page_shows_a_block_and_its_response(opened, explorer):
    page = opened()
    response = statue()
    assert page.text("#verdict") == page_answer(explorer, "case", dict(parse_qsl(STATUE))).header["verdict"]
    peak = as_number(page.page.locator("#figures dd").first.text_content())
    assert peak == pytest.approx(response.peak_over_slenderness, rel=2e-3)
    assert page.page.locator("#scene .block").is_visible() and page.page.locator("#rotation path.line").count() >= 1
    page.page.locator("#all-numbers > summary").click()
    page.page.locator("#phase > summary").click()
    page.page.locator("#chattering > summary").click()
    page.until(
        "document.querySelectorAll('#plane path.line').length && document.querySelectorAll('#ratios .dot').length"
    )
    rows = page.page.locator("#sequences tbody tr").all_text_contents()
    assert len(rows) == len(response.sequences) and f"{response.sequences['end'][0]:.9f}" in rows[0]
    assert "stands in 5 of 5 motions" in page.text("#words")


def test_a_slider_and_a_field_change_the_response(opened):
    page = opened(STATUE)
    page.rested(lambda: page.page.locator("#pga-slider").fill("800"))
    sent = query_of(page)["pga"]
    assert sent.endswith("g") and float(sent[:-1]) > 0.8
    assert page.text("#verdict").startswith("It overturns")
    page.rested(lambda: fill(page, "width", "24 cm"))
    assert query_of(page)["width"] == "24 cm" and page.page.locator("#width").input_value() == "0.24"
    page.rested(lambda: fill(page, "restitution", "0.9"))
    assert query_of(page)["restitution"] == "0.9"
    page.rested(lambda: fill(page, "restitution", ""))
    assert "restitution" not in query_of(page)
    assert as_number(page.page.locator("#restitution").get_attribute("placeholder")) == pytest.approx(0.9318, abs=1e-4)


@pytest.mark.parametrize(
    ("name", "text"), [("width", "-1"), ("pga", "much"), ("restitution", "0.9999"), ("friction", "-3")]
)
def test_what_is_refused_is_marked_and_leaves_the_last_case_in_grey(opened, name, text):
    page = opened(STATUE, allowed=["422"])
    verdict = page.text("#verdict")
    fill(page, name, text)
    page.until(STALE)
    assert page.js(MARKED) == [name] and page.text("#verdict") == verdict
    assert page.page.locator("#problem").is_visible()
    page.rested(lambda: fill(page, name, {"width": "0.3", "pga": "0.3g", "restitution": "0.9"}.get(name, "")))
    assert page.js(MARKED) == [] and page.page.locator("#problem").is_hidden() and not page.js(STALE)


def test_the_block_is_described_otherwise_and_stays_the_same(opened):
    page = opened(f"{STATUE}&offset=0.03")
    before = page.text("#verdict")
    for shape, name in (("pivots", "pivots"), ("parameters", "alpha")):
        page.rested(lambda shape=shape: page.page.select_option("#shape", shape))
        assert page.text("#verdict") == before
        assert "," in query_of(page)[name] and "/" in page.page.locator(f"#{name}").input_value()
    page.rested(lambda: fill(page, "p", "2 / 2.5"))
    assert query_of(page)["p"] == "2,2.5"


def test_motions_are_chosen_scaled_and_released(opened):
    page = opened(STATUE)
    page.rested(lambda: page.page.select_option("#motion", "el-centro-meloland-270#"))
    query = query_of(page)
    assert (query["motion"], query["pga"]) == ("el-centro-meloland-270", "0.4g")
    page.rested(lambda: page.page.select_option("#vertical", "el-centro-meloland-up"))
    assert page.page.locator("#ground path.vertical").count() >= 1
    page.rested(lambda: page.page.select_option("#scaled", "sa"))
    page.rested(lambda: fill(page, "period", "0.5"))
    assert query_of(page)["sa"] == "0.5g@0.5"
    page.rested(lambda: page.page.select_option("#motion", "pulse:ricker"))
    page.rested(lambda: page.page.select_option("#pulse-kind", "antisymmetric"))
    assert query_of(page)["motion"].endswith("kind=antisymmetric")
    page.rested(lambda: page.page.select_option("#motion", "none#"))
    query = query_of(page)
    assert (query["motion"], query["initial_rotation"]) == ("none", "3deg")


def test_a_slipping_block_moves_along(opened):
    page = opened("width=0.4&height=0.8&motion=ridgecrest-clc-090&pga=0.9g&friction=0.35&at=235")
    response = rocking.simulate(
        rocking.Block(width=0.4, height=0.8), rocking.records.load("ridgecrest-clc-090").scaled_to(0.9 * 9.80665),
        friction=0.35,
    )  # fmt: skip
    page.says("reading", f"slip {response.slip(235.0):.3g} m".replace("-", "−"))
    assert page.page.locator("#slip path.line").count() == 1
    assert "friction=0.35" in page.text("#python") and "--friction 0.35" in page.text("#command")
    page.page.click("[data-tab=explore]")
    page.until("!document.getElementById('problem').hidden")
    assert "Friction coefficient" in page.text("#problem") and page.js(MARKED) == ["friction"]
    page.allowed = ["422"]
    page.complaints = [each for each in page.complaints if "422" not in each]


@pytest.mark.parametrize("query", ["from=232&to=234&at=232.7&sa=0.3g@1", "chattering=velocity%3D0.05&model=linear"])
def test_a_link_reproduces_what_is_shown(opened, query):
    texts = dict(parse_qsl(f"{STATUE}&{query}"))
    if "sa" in texts:
        del texts["pga"]
    page = opened(urlencode(texts))
    verdict = page.text("#verdict")
    assert query_of(page) == texts
    page.page.reload()
    page.until(READY)
    assert page.text("#verdict") == verdict and query_of(page) == texts


@pytest.mark.parametrize(("seed", "count"), [(1, 12), pytest.param(2, 60, marks=MORE)])
def test_whatever_an_address_says_the_page_has_no_fault(opened, here, seed, count):
    draw, shown = random.Random(seed), 0
    page = opened(STATUE, allowed=["422"])
    for _ in range(count):
        texts = explorer_addresses.case(draw) | explorer_addresses.shown(draw)
        page.page.goto(f"http://127.0.0.1:{here.port}/?{urlencode(texts)}")
        page.until("document.body?.dataset.ready && (document.body.dataset.drawn || !problem.hidden)")
        assert "fault" not in page.text("#problem"), texts
        shown += page.page.locator("#problem").is_hidden()
    assert shown >= count // 12


@pytest.mark.parametrize("width", [3.0, pytest.param(1e-3, marks=MORE), 1e-8])
def test_a_zoom_shows_the_engines_own_values(opened, explorer, width):
    rest = float(statue().sequences["end"][-1])
    page = opened(f"{STATUE}&from={rest - width!r}&to={rest + 0.1 * width!r}")
    payload = page_answer(explorer, "case", dict(parse_qsl(STATUE)), (rest - width, rest + 0.1 * width))
    page.page.locator("#chattering > summary").click()
    page.says("depth", f"with {payload.header['window']['impacts']} impact")
    label = page.page.locator("#ground text", has_text="time").text_content()
    assert ("after" in label) == (width < 0.5)


def test_keys_drags_and_buttons_move_the_window(opened):
    page = opened(STATUE)
    window = (
        "JSON.stringify([...new URLSearchParams(location.search)].filter(([name]) => ['from', 'to'].includes(name)))"
    )
    page.page.locator("#histories").focus()
    widths = []
    for key in ("+", "ArrowRight", "-", "0"):
        page.page.keyboard.press(key)
        page.paused(600)
        found = dict(json.loads(page.js(window)))
        widths.append(float(found["to"]) - float(found["from"]) if found else None)
    assert widths[0] == pytest.approx(widths[1]) and widths[2] == pytest.approx(2.0 * widths[0]) and widths[3] is None
    box = page.page.locator("#rotation svg.chart").bounding_box()
    page.page.mouse.move(box["x"] + 0.4 * box["width"], box["y"] + 60)
    page.page.mouse.down()
    page.page.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + 80, steps=4)
    page.rested(page.page.mouse.up)
    narrow = query_of(page)
    assert 0.1 * 14 < float(narrow["to"]) - float(narrow["from"]) < 0.4 * 14
    page.page.locator("#chattering > summary").click()
    for _ in range(3):
        page.rested(lambda: page.page.click("#closer"))
    closer = query_of(page)
    assert float(closer["to"]) - float(closer["from"]) < 0.02
    page.rested(lambda: page.page.click("[data-zoom=all]"))
    assert float(query_of(page)["from"]) == 0.0


def test_a_time_is_read_clicked_typed_and_played(opened):
    page, response = opened(STATUE), statue()
    fill(page, "at", "232.5 s")
    page.until("document.getElementById('reading').dataset.time === '232.5'")
    alpha = response.block.alpha
    assert f"= {response.rotation(232.5) / alpha:.3g} α".replace("-", "−") in page.text("#reading")
    assert query_of(page)["at"] == "232.5"
    box = page.page.locator("#rotation svg.chart").bounding_box()
    page.page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 50)
    page.until("document.getElementById('reading').dataset.time !== '232.5'")
    turned = "document.querySelector('#scene g').getAttribute('transform')"
    before = page.js(turned)
    page.page.click("#play")
    page.paused(900)
    assert page.js(turned) != before and page.text("#play") == "Pause"
    page.page.click("#play")
    stopped = page.js(turned)
    page.paused(200)
    assert page.js(turned) == stopped and page.text("#play") == "Play"
    fill(page, "at", "999")
    page.until("!document.getElementById('problem').hidden")
    assert page.js(MARKED) == ["at"]
    page.complaints = [each for each in page.complaints if "422" not in each]


def test_a_kept_case_is_compared_with_what_follows(opened, explorer):
    page = opened(STATUE)
    page.rested(lambda: page.page.click("#keep"))
    page.rested(lambda: page.page.select_option("#treatment", "velocity"))
    assert page.page.locator("#rotation path.second").count() >= 1
    texts = dict(parse_qsl(STATUE))
    said = page_answer(explorer, "case", texts).header["verdict"]
    assert page.text("#other-verdict").endswith(said) and "proof" in page.text("#other-verdict")
    assert page.text("#verdict") != said
    query = query_of(page)
    assert dict(parse_qsl(query["other"])) == texts and query["chattering"] == "velocity=0.05"
    page.rested(lambda: page.page.click("#keep"))
    assert "other" not in query_of(page) and page.page.locator("#other-verdict").is_hidden()


def test_the_last_choice_is_shown_however_late_an_answer_comes(opened):
    page = opened(STATUE)
    late = {"count": 0}

    def delay(route):
        late["count"] += 1
        if late["count"] == 1:
            page.page.wait_for_timeout(400)
        route.continue_()

    page.page.route("**/api/case?*", delay)
    for level in ("0.45g", "0.5g", "0.1g"):
        page.page.fill("#pga", level)
        page.page.press("#pga", "Enter")
    page.says("verdict", "It does not move")
    page.paused(600)
    assert query_of(page)["pga"] == "0.1g" and late["count"] >= 2


# Files


def test_a_file_is_asked_about_and_shown(opened, tmp_path):
    record = rocking.records.load("el-centro-meloland-270")
    file = tmp_path / "1234"
    file.write_text("\n".join(f"{value / 9.80665:.12g}" for value in record.samples), "utf-8")
    page = opened(STATUE)
    page.page.set_input_files("#files", file)
    page.until("document.querySelectorAll('#motion-form .missing').length === 2")
    said = page.text("#motion-form")
    assert (
        f"PGA {record.pga / 9.80665:.3g} g" in said and f"lasts {record.duration:.4g} s" in said and "gal" not in said
    )
    assert "motion=ridgecrest" in page.page.url
    assert page.js(STALE) and "1234 is not used yet" in page.text("#problem")  # results are of the last motion
    page.page.locator("#motion-form .missing button", has_text="0.02 s").click()
    page.until("document.querySelectorAll('#motion-form .missing').length === 1")
    page.rested(lambda: page.page.locator("#motion-form .missing button", has_text="m/s2").first.click())
    assert not page.js(STALE)
    assert {"dt": "0.02", "units": "m/s2"}.items() <= query_of(page).items()
    page.page.locator("#motion-form button", has_text="change").click()
    page.page.locator("#motion-form .missing button", has_text="0.01 s").click()
    page.until("document.querySelectorAll('#motion-form .missing').length === 1")
    page.rested(lambda: page.page.locator("#motion-form .missing button", has_text=re.compile("^g$")).click())
    assert "rocking.read('1234'" in page.text("#python")
    page.page.locator("#motion-form summary", has_text="Corrections").click()
    page.rested(lambda: fill(page, "baseline", "1"))
    assert "baseline='1'" in page.text("#python") and "--baseline 1" in page.text("#command")
    assert query_of(page)["baseline"] == "1"
    fill(page, "baseline", "much")
    page.until(STALE)
    assert page.js(MARKED) == ["baseline"]
    page.rested(lambda: fill(page, "baseline", ""))
    assert "baseline" not in page.text("#python") and not page.js(STALE)
    page.complaints = [each for each in page.complaints if "422" not in each]
    response = rocking.simulate(rocking.Block(width=0.24, height=1.1), record)
    assert ("overturns" in page.text("#verdict")) == response.overturned


def test_several_files_are_listed_assessed_and_removed(opened, explorer):
    page, rng = opened(STATUE, allowed=["422"]), np.random.default_rng(3)
    files = []
    for name in ("a_ns.csv", "a_ew.csv", "a_ud.csv", "<img src=x onerror=alert(1)>.csv"):
        values = np.cumsum(rng.normal(size=900)) * 0.05
        rows = "\n".join(f"{0.01 * k:.2f}, {value - values.mean():.6f}" for k, value in enumerate(values))
        files.append({"name": name, "mimeType": "text/csv", "buffer": f"time (s), a (m/s2)\n{rows}\n".encode()})
    files.append({"name": "broken.at2", "mimeType": "text/plain", "buffer": b"hello"})
    page.page.set_input_files("#files", files)
    page.until("document.body.dataset.taken")
    assert "broken.at2" in page.text("#problem") and page.js("document.body.dataset.view") == "assess"
    names = page.page.locator("#records tbody button.link").all_text_contents()
    assert "<img src=x onerror=alert(1)>.csv" in names and "a_ud.csv" in names
    page.page.fill("#search", "a_")
    page.until("document.querySelectorAll('#records tbody').length === 1")
    assert page.page.locator("#records input[type=checkbox]").count() == 3
    page.page.locator("#sort-1").click()
    assert page.js("document.activeElement.id") == "sort-1"
    page.page.locator("#records .station button").first.click()
    page.until("document.querySelectorAll('#records tbody').length === 0")
    page.page.fill("#search", "")
    page.page.locator("#records button.link", has_text="China Lake, 360").click()
    page.until("document.body.dataset.view === 'shake' && location.search.includes('ridgecrest-clc-360')")
    assert explorer.uploads.count_usage()["files"] >= 1


def test_a_mesh_is_dropped_turned_and_drawn(opened):
    box = trimesh.creation.box((0.2, 0.4, 1.0))
    box.apply_translation([0.0, 0.0, 0.5])
    page = opened(STATUE)
    drop = """([name, bytes]) => {
      const given = new DataTransfer();
      given.items.add(new File([new Uint8Array(bytes)], name));
      document.dispatchEvent(new DragEvent('drop', {dataTransfer: given, bubbles: true, cancelable: true}));
    }"""
    page.rested(lambda: page.js(drop, ["box.stl", list(box.export(file_type="stl"))]))
    query = query_of(page)
    assert query["mesh"].startswith("file:") and float(query["azimuth"]) % 180.0 == 90.0
    assert "Solid.from_mesh('box.stl').block(" in page.text("#python")
    plan = page.page.locator("#plan svg").bounding_box()
    page.rested(lambda: page.page.mouse.click(plan["x"] + 0.5 * plan["width"], plan["y"] + 20))
    assert float(query_of(page)["azimuth"]) % 360.0 == pytest.approx(0.0, abs=2.0)
    page.rested(lambda: fill(page, "azimuth", "90"))
    assert page.page.locator("#scene .block").is_visible()


# Copies


@pytest.mark.parametrize(
    "query", [STATUE, "p=2&alpha=12deg&motion=sine:amplitude%3D0.3g,frequency%3D1,cycles%3D2&model=linear"]
)
def test_the_copied_command_and_the_script_have_the_same_peak(opened, tmp_path, run, query):
    page = opened(query)
    page.until(READY)
    response = read_case(dict(parse_qsl(query)), UploadStore()).simulate()
    code, out, _ = run(*shlex.split(page.text("#command"))[1:], "--json")
    assert code == 0 and json.loads(out)["peak_rotation_rad"] == response.peak_rotation
    (tmp_path / "case.py").write_text(page.text("#python"), "utf-8")
    assert runpy.run_path(str(tmp_path / "case.py"))["response"].peak_rotation == response.peak_rotation


def test_files_are_saved_under_the_name_of_the_case(opened):
    page = opened(STATUE)
    page.until(READY)
    names = []
    for label in ("Rotation, PNG", "Events, CSV"):
        with page.page.expect_download() as download:
            page.page.locator("#exports button", has_text=label).click()
        names.append(download.value.suggested_filename)
    case = "p-3.61-rad-s-alpha-12.3deg-ridgecrest-clc-090-0.4-g"
    assert names == [f"{case}-rotation.png", f"{case}.events.csv"]


@pytest.mark.parametrize("scheme", ["light", pytest.param("dark", marks=MORE)])
def test_a_case_is_printed_whole_by_the_menu_of_the_browser(opened, scheme):
    page = opened(STATUE, scheme=scheme)
    page.until(READY)
    paper = page.page.pdf(prefer_css_page_size=True)
    assert 1 <= len(re.findall(rb"/Type\s*/Page\b", paper)) <= 2
    page.page.emulate_media(media="print")
    controls = page.page.query_selector_all("button, select, input")
    assert len(controls) > 30 and not any(each.is_visible() for each in controls)
    assert page.page.locator("#verdict").is_visible() and page.page.locator("#command").is_visible()
    page.page.set_viewport_size({"width": 700, "height": 1000})
    for name in ("rotation", "ground"):
        box = page.page.locator(f"#{name} svg.chart").bounding_box()
        assert box["x"] >= 0.0 and box["x"] + box["width"] <= 700.0
        whole = page.js(f"document.querySelector('#{name} svg.chart').viewBox.baseVal.width")
        assert whole > 100


# Explore


def test_a_map_is_drawn_with_the_case_in_it_and_a_click_opens_a_case(opened):
    page = opened(f"{SINE}&view=map&points=24")
    page.until(COMPUTED["map"], timeout=120.0)
    assert page.page.locator("#map .dot.case").count() >= 2
    grid = maps.read_grid(read_case(dict(parse_qsl(SINE)), UploadStore()), {"points": "24"})
    values = {}
    for part in maps.simulate_grid(grid):
        for k, index in enumerate(part.arrays["points"].astype(int)):
            values[index] = part.arrays["outcome"][k]
    complete = 100.0 * sum(value == 1 for value in values.values()) / 576
    assert f"complete, {complete:.2g} %" in page.text("#map")
    page.page.locator("#map").focus()
    page.page.keyboard.press("ArrowUp")
    assert "first rocking" in page.text("#map-at")
    for quantity in ("peak", "mode", "rest"):
        page.page.select_option("#quantity", quantity)
    assert query_of(page)["quantity"] == "rest" and "chattering_map(case" in page.text("#python")
    box = page.page.locator("#map svg.chart").bounding_box()
    page.page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 0.3 * box["height"])
    page.until("document.body.dataset.view === 'shake' && location.search.includes('frequency')")
    page.page.go_back()
    page.until("document.body.dataset.view === 'map'")
    assert page.page.locator("#quantity").input_value() == "rest"


def test_a_map_of_one_pulse_contains_its_case(opened):
    page = opened("p=2&alpha=0.2&motion=one-sine:amplitude%3D0.6g,frequency%3D1&view=map&points=16")
    page.until(COMPUTED["map"], timeout=120.0)
    low, high = (float(page.page.locator(f"#y_{end}").input_value()) for end in ("from", "to"))
    assert low < 0.6 / math.tan(0.2) < high and high > 2.0


def test_a_map_is_zoomed_and_its_fields_are_refused(opened):
    page = opened(f"{SINE}&view=map&points=16", allowed=["422"])
    page.until(COMPUTED["map"], timeout=120.0)
    box = page.page.locator("#map svg.chart").bounding_box()
    page.page.mouse.move(box["x"] + 300, box["y"] + 100)
    page.page.mouse.down()
    page.page.mouse.move(box["x"] + 500, box["y"] + 250, steps=4)
    page.page.mouse.up()
    page.until("location.search.includes('x_from')")
    page.until(COMPUTED["map"], timeout=120.0)
    query = query_of(page)
    assert 0.5 < float(query["x_from"]) < float(query["x_to"]) < 8.0 and float(query["y_to"]) < 1.1
    page.page.click("#map-out")
    page.until("!location.search.includes('x_from')")
    fill(page, "x_to", "0.1")
    page.until("!document.getElementById('problem').hidden")
    assert "x_from" in page.js(MARKED) and "must be positive and below" in page.text("#problem")


def test_a_map_is_saved_as_figure_numbers_and_code(opened):
    page = opened(f"{SINE}&view=map&points=12")
    page.until(COMPUTED["map"], timeout=120.0)
    found = {}
    for label in ("Figure, SVG", "Figure, PNG", "Numbers, CSV"):
        with page.page.expect_download() as download:
            page.page.locator("#exports button", has_text=label).click()
        found[download.value.suggested_filename] = Path(download.value.path()).read_bytes()
    svg, png, numbers = (found[f"rocking-map-outcome-omega-a.{end}"] for end in ("svg", "png", "csv"))
    assert svg.startswith(b"<svg") and b"overturns" in svg
    assert Image.open(io.BytesIO(png)).size[0] > 1000
    rows = [line.split(",") for line in numbers.decode().splitlines() if not line.startswith("#")]
    assert rows[0] == ["omega", "a", "outcome", "rest", "peak", "mode"] and len(rows) == 145


def test_a_study_opens_as_a_map(opened, tmp_path):
    blocks = rocking.Blocks.grid(p=[2.0, 3.0, 5.0], alpha=np.linspace(0.1, 0.3, 4), restitution=[0.9])
    study = rocking.create_study(
        tmp_path / "museum", blocks, rocking.pulses.one_sine(1.0, 1.0), levels=[2.0, 4.0], measure="pga"
    )
    study.run()
    server = Server(Explorer({"view": "map"}, StudyView(tmp_path / "museum")))
    server.run_in_background()
    page = opened(server=server)
    page.until(COMPUTED["map"])
    page.page.locator("#map-tools label", has_text="scale").locator("select").select_option("1")
    page.until("location.search.includes('scale_index=1')")
    page.until(COMPUTED["map"])
    page.page.locator("#map").focus()
    page.page.keyboard.press("ArrowRight")
    page.page.keyboard.press("ArrowUp")
    said = page.text("#map-at")
    page.rested(lambda: page.page.keyboard.press("Enter"))
    page.until("document.body.dataset.view === 'shake' && location.search.includes('alpha')")
    page.until(f"document.title.includes({re.search(r'p = [0-9.]+ rad/s', said)[0]!r})", "the case is shown")
    assert ("overturns" in page.text("#verdict")) == ("Overturns" in said or ": overturns" in said)
    server.server.should_exit = True


def test_a_diagram_is_read_by_keys_and_opens_a_case(opened):
    page = opened(f"{STATUE}&view=periodic")
    page.until("!document.getElementById('problem').hidden")
    assert "requires a sine" in page.text("#problem") and page.js(MARKED) == ["motion"]
    assert page.page.locator("#orbit").is_hidden() and page.text("#python") == ""
    page.complaints = [each for each in page.complaints if "422" not in each]
    page.page.goto(f"{page.page.url.partition('?')[0]}?{SINE}&view=periodic&sweep_points=16")
    page.until(COMPUTED["periodic"], timeout=180.0)
    page.page.locator("#diagram").focus()
    page.page.keyboard.press("ArrowRight")
    assert "swept upwards" in page.text("#sweep-at")
    assert "dynamics.bifurcation_diagram" in page.text("#python")
    with page.page.expect_download() as download:
        page.page.locator("#exports button", has_text="Numbers").click()
    assert Path(download.value.path()).read_text().count("\n") > 4
    page.page.locator("#diagram").focus()
    page.page.keyboard.press("Enter")
    page.until("document.body.dataset.view === 'shake'")
    assert query_of(page)["motion"].startswith("sine:")


# Assess


def test_an_assessment_is_that_of_the_package(opened):
    page = opened(f"{STATUE}&view=assess&records={RECORDS}&level_from=0.2g&level_to=0.8g&levels=8")
    page.until(COMPUTED["assess"], timeout=180.0)
    motions = [rocking.records.load(name) for name in ("el-centro-meloland-270", "ridgecrest-clc-360")]
    levels = np.linspace(0.2, 0.8, 8) * 9.80665
    found = rocking.assess(rocking.Block(width=0.24, height=1.1), motions, levels=levels, polarity="both")
    said = page.page.locator("#statements li").all_text_contents()
    assert any(f"overturn it at {found.format_curve(found.objects[0])[0]} g" in each for each in said)
    rows = page.page.locator("#records tr", has=page.page.locator("input:checked")).all_text_contents()
    assert len(rows) == 2 and all(" g to " in row or "above " in row for row in rows)
    assert "rocking.assess" in page.text("#python") and "rocking assess" in page.text("#command")
    with page.page.expect_download() as download:
        page.page.locator("#exports button", has_text="Report, HTML").click()
    report = Path(download.value.path()).read_text("utf-8")
    assert download.value.suggested_filename == "rocking-assessment-pga.html" and "Half of the motions" in report
    page.page.emulate_media(media="print")
    heading, value = (
        page.page.locator(f"#records {cell}:has-text('{text}') >> nth=0").bounding_box()
        for cell, text in (("th", "PGV"), ("td", "m/s"))
    )
    assert heading["x"] == value["x"] and page.js("python.scrollWidth <= python.clientWidth")
    page.page.emulate_media(media="screen")
    page.page.locator("#records tr", has_text="China Lake, 090").locator("input").check()
    page.page.click("#assess")
    page.until("document.querySelectorAll('#statements li')[0].textContent.includes('of 3')")
    assert query_of(page)["records"].count("motion") == 3
    fill(page, "levels", "1")
    page.until("!document.getElementById('problem').hidden")
    assert page.js(MARKED) == ["levels"]
    page.complaints = [each for each in page.complaints if "422" not in each]


# People


def test_units_are_chosen_once_and_in_the_address(opened):
    page = opened(STATUE)
    with page.page.expect_navigation():
        page.page.select_option("#length_in", "ft")
    page.until(READY)
    assert query_of(page)["length_in"] == "ft"
    assert as_number(page.page.locator("#width").input_value()) == pytest.approx(0.24 / 0.3048, rel=1e-3)
    page.rested(lambda: fill(page, "width", "1"))
    assert query_of(page)["width"] == "1ft"
    assert page.page.locator("#scene text").text_content().endswith("ft")


def barriers(page):
    options = "{resultTypes: ['violations'], rules: {'target-size': {enabled: true}}}"
    # A chart is one picture; its thousands of marks take most of the time.
    found = page.js(f"axe.run({{exclude: [['svg.chart *']]}}, {options})")
    return [(each["id"], [node["target"] for node in each["nodes"]][:4]) for each in found["violations"]]


@pytest.mark.parametrize(
    ("viewport", "scheme"), [(DESK, "light"), pytest.param(PHONE, "dark", marks=MORE)], ids=["desk", "phone"]
)
def test_no_view_has_a_barrier(opened, viewport, scheme):
    axe = tool("axe-core/axe.min.js").read_text("utf-8")
    query = f"{SINE}&points=16&sweep_points=16&levels=4&records={RECORDS}"
    page = opened(query, viewport, scheme, bypass_csp=True, allowed=["422"])
    page.js(axe + "; 1")
    for name in ("phase", "chattering", "all-numbers"):
        page.page.locator(f"#{name} > summary").click()
    for view in ("shake", "map", "periodic", "assess"):
        if view != "shake":
            tab = "assess" if view == "assess" else "explore"
            page.page.click(f"[data-tab={tab}]")
            if tab == "explore":
                page.page.click(f"[data-view={view}]")
        page.until(COMPUTED[view], timeout=180.0)
        page.js("scrollTo(0, 0)")
        page.until("document.getAnimations().every(({playState}) => playState !== 'running')")
        assert barriers(page) == [], view
        assert page.js("document.documentElement.scrollWidth") <= viewport["width"], view
    if viewport is PHONE:
        page.page.click("#to-settings")
        assert barriers(page) == [], "settings"
        page.page.keyboard.press("Escape")
    page.page.click("[data-tab=shake]")
    if viewport is PHONE:
        page.page.click("#to-settings")
    fill(page, "p", "-1")
    page.until(STALE)
    page.js("scrollTo(0, 0)")
    assert [each for each in barriers(page) if each[0] != "color-contrast"] == []


def test_every_control_shows_its_focus_and_is_large_enough(opened):
    page = opened(STATUE)
    page.until(READY)
    seen, faint, small = set(), set(), set()
    for _ in range(80):
        page.page.keyboard.press("Tab")
        name, outline, *size = page.js(
            """(() => {
              const each = document.activeElement, {outlineStyle, outlineWidth} = getComputedStyle(each);
              const box = (each.type === 'checkbox' ? each.closest('label') : each).getBoundingClientRect();
              const name = each === document.body ? 'end' : each.id || each.textContent.trim();
              return [name, outlineStyle === 'none' ? 0 : parseFloat(outlineWidth), box.width, box.height];
            })()"""
        )
        if name == "end":
            break
        seen.add(name)
        faint |= {name} if outline < 2 else set()
        small |= {name} if min(size) < 24 else set()
    assert len(seen) > 30 and faint == set() and small == set()


def test_a_phone_shows_the_block_while_settings_are_changed(opened):
    page = opened(STATUE, PHONE, has_touch=True, is_mobile=True)
    assert page.page.locator("#width").is_hidden()
    page.page.click("#to-settings")
    page.rested(lambda: fill(page, "pga", "0.9g"))
    sheet = page.page.locator("#settings").bounding_box()
    assert sheet["y"] > 0.45 * PHONE["height"]
    page.page.keyboard.press("Escape")
    assert page.page.locator("#width").is_hidden() and page.text("#verdict").startswith("It overturns")


# The secret


@contextmanager
def notebook(html):
    """A page of another origin that shows some HTML."""

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.send_header("content-type", "text/html; charset=utf-8")
            self.end_headers()
            self.wfile.write(f"<!doctype html><title>notebook</title><body><div>{html}</div></body>".encode())

        def log_message(self, *_):
            pass

    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield server.server_address[1]
        server.shutdown()


def test_another_tab_has_the_secret_and_other_origins_have_nothing(browser, here):
    context = browser.new_context(viewport=DESK)
    first = Watched(context.new_page(), allowed=["CORS", "Failed to load", "403", "frame"])
    first.page.goto(here.create_link({"width": "0.3", "height": "1.2"}))
    first.until(READY)
    address, secret = first.page.url, first.js("localStorage.getItem('rocking-secret')")
    assert len(secret) > 40 and "#" not in address and secret not in address
    second = Watched(context.new_page())
    second.page.goto(address)
    second.until(READY)
    with notebook(f'<iframe src="http://127.0.0.1:{here.port}/"></iframe>') as port:
        first.page.goto(f"http://127.0.0.1:{port}/")
        for mode in ("cors", "no-cors"):
            read = f"fetch('http://127.0.0.1:{here.port}/api/start', {{mode: '{mode}', credentials: 'include'}})"
            assert first.js(f"{read}.then((r) => r.text(), () => '')") == ""
        assert first.js("Object.keys(localStorage)") == []
        first.page.wait_for_timeout(300)
        assert first.page.frames[1].evaluate("document.body?.textContent.includes('Ground motion') ?? false") is False
    assert context.cookies() == [] and second.complaints == []
    context.close()


def test_an_open_tab_goes_on_after_a_restart_once_its_new_link_was_opened(browser):
    first = Server(Explorer())
    first.run_in_background()
    context = browser.new_context(viewport=DESK)
    page = Watched(context.new_page(), allowed=["403", "ERR_CONNECTION", "net::"])
    page.page.goto(first.create_link())
    page.until(READY)
    port = first.port
    first.server.should_exit = True
    first.server.force_exit = True
    for _ in range(200):
        try:
            second = Server(Explorer(), port=port)
            break
        except rocking.RockingError:
            page.page.wait_for_timeout(50)
    second.run_in_background()
    fill(page, "pga", "0.5g")
    page.until("!document.getElementById('problem').hidden")
    other = Watched(context.new_page())
    other.page.goto(second.create_link())
    other.until(READY)
    page.rested(lambda: fill(page, "pga", "0.1g"))
    assert page.text("#verdict").startswith("It does not move") and page.page.locator("#problem").is_hidden()
    context.close()
    second.server.should_exit = True


def test_a_browser_without_the_link_is_told_so(browser, here):
    context = browser.new_context(viewport=DESK)
    page = Watched(context.new_page(), allowed=["403"])
    for fragment in ("", "#token=spent"):
        page.page.goto(f"http://127.0.0.1:{here.port}/?width=0.3&height=1.2{fragment}")
        page.until("!document.getElementById('problem').hidden")
        assert "requires the link that rocking explore printed" in page.text("#problem")
        page.page.goto("about:blank")
    assert page.complaints == []
    context.close()


# The modules


def test_the_modules_pass_the_type_checker():
    compiler = tool("typescript/bin/tsc")
    folder = Path(rocking.__file__).parent / "explorer" / "page"
    options = (
        "--noEmit --allowJs --checkJs --strict --target es2022 --module esnext --moduleResolution bundler "
        "--lib es2023,dom,dom.iterable"
    )
    found = subprocess.run(
        ["node", compiler, *options.split(), *sorted(folder.rglob("*.js"))], capture_output=True, text=True
    )
    assert found.returncode == 0, found.stdout


def test_the_modules_pass_the_linter():
    linter = tool("eslint/bin/eslint.js")
    folder = Path(rocking.__file__).parent / "explorer" / "page"
    rules = Path(__file__).parent / "page.eslint.mjs"
    words = ["node", linter, "--no-config-lookup", "--max-warnings", "0", "--config", rules, folder]
    found = subprocess.run(words, capture_output=True, text=True)
    assert found.returncode == 0, found.stdout + found.stderr
