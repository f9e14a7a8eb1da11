"""The explorer's page in a browser: every view, every way in and out, against the package's own numbers."""

import hashlib
import http.server
import io
import itertools
import json
import math
import random
import re
import runpy
import shlex
import subprocess
import sys
import threading
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import parse_qs, parse_qsl, urlencode

import explorer_addresses
import numpy as np
import pytest
import trimesh
from explorer_browser import Watched, launched, remembering, slowed, tool
from explorer_texts import in_english
from PIL import Image

import rocking
from rocking.chattering.families import sine
from rocking.explorer import maps
from rocking.explorer.core import Explorer
from rocking.explorer.inputs import read_case
from rocking.explorer.launch import start_listening
from rocking.explorer.studies import StudyView
from rocking.inputs import quantities
from rocking.plot.canvas import compute_cell_edges
from rocking.response.summary import round_ratio

pytestmark = pytest.mark.browser

STATUE = "width=0.24&height=1.1&motion=ridgecrest-clc-090&pga=0.4g"
SINE = "p=2&alpha=0.2&restitution=0.92&motion=sine:amplitude%3D2.02,frequency%3D0.6366197723675814,cycles%3D2.5"
DESK, PHONE = {"width": 1280, "height": 900}, {"width": 390, "height": 844}
RECORDS = "%3B".join(
    f"motion%3D{name}" for name in ("el-centro-meloland-270", "el-centro-meloland-360", "ridgecrest-clc-360")
)
#: All models of the plotting library on the page.
MODELS = "Bokeh.documents.flatMap((each) => [...each._all_models.values()])"
VIEWS = ("response", "block", "map", "periodic", "compare")
#: Further cases of what a faster run holds, too.
MORE = pytest.mark.thorough
READY = "document.body?.dataset.ready && document.body.dataset.rested"
#: What is drawn in grey.
GREY = "Array.from(document.querySelectorAll('.old :is(.plots, .verdict, .links)'), (each) => each.id)"
#: Fields that are marked as wrong.
MARKED = "Array.from(document.querySelectorAll('[aria-invalid=true]'), (each) => each.id)"


@pytest.fixture(scope="module")
def browser():
    with launched() as started:
        yield started


@pytest.fixture(scope="module")
def explorer():
    return Explorer()


@pytest.fixture(scope="module")
def here(explorer):
    running = start_listening(explorer, {})
    running.run_in_background()
    yield running
    running.server.should_exit = True


@pytest.fixture(scope="module")
def new_page(browser, tmp_path_factory):
    """Make empty pages, in as few contexts as there can be, so that the plotting library is loaded once in each."""
    contexts = {}

    def made(viewport, scheme, **options):
        if not options:
            if "plain" not in contexts:
                contexts["plain"] = remembering(browser, tmp_path_factory.mktemp("profile"))
            page = slowed(contexts["plain"].new_page())
            page.set_viewport_size(viewport)
            page.emulate_media(color_scheme=scheme)
            return page
        options |= {"viewport": viewport, "color_scheme": scheme}
        key = json.dumps(options, sort_keys=True)
        if key not in contexts:
            contexts[key] = browser.new_context(**options)
        return slowed(contexts[key].new_page())

    yield made
    for context in contexts.values():
        context.close()


@pytest.fixture
def opened(new_page, here):
    """Open the page with a query; in the end nothing may have gone wrong on it."""
    pages = []

    def open_page(query="", viewport=DESK, scheme="light", server=here, allowed=(), **options):
        page = Watched(new_page(viewport, scheme, **options), allowed)
        pages.append((page, server))
        page.page.goto(server.link(dict(parse_qsl(query))))
        page.until("document.body.dataset.ready && document.body.dataset.rested", "the page is ready")
        return page

    yield open_page
    for page, _ in pages:
        page.page.close()
    for page, server in pages:
        assert page.complaints == []
        assert page.hosts <= {f"127.0.0.1:{server.port}", "data", ""}


def query_of(page):
    page.paused(250)
    return {name: values[0] for name, values in parse_qs(page.js("location.search.slice(1)")).items()}


def statue(level, measure="pga"):
    block = rocking.Block(width=0.24, height=1.1)
    return rocking.simulate(block, rocking.records.load("ridgecrest-clc-090").scaled_to(level, measure))


def as_number(text):
    """The number that the page writes so, as 3.14·10⁻⁵."""
    mantissa, _, power = text.replace("−", "-").partition("·10")
    exponent = int(power.translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")) or "0")
    return float(f"{mantissa}e{exponent}")


def peak_shown(page):
    return as_number(page.text("#figures div:first-child dd").split(" ")[0])


# The response


def test_the_first_page_shows_a_block_that_chatters(opened):
    page = opened()
    response = statue(0.4 * 9.80665)
    assert page.text("#verdict") == (
        "It stays up: it reaches 27 % of the overturning rotation, and comes to rest 4 times."
    )
    assert peak_shown(page) == pytest.approx(round_ratio(response), rel=2e-3)
    assert len(page.page.query_selector_all("#sequences tbody tr")) == 4
    rests = [
        row.query_selector_all("td")[3].text_content() for row in page.page.query_selector_all("#sequences tbody tr")
    ]
    assert rests == [f"{time:.9f}" for time in response.sequences["end"]]
    cells = page.page.locator("#sequences tbody tr:last-child td").all_text_contents()
    assert cells[4] == "± 1.25 s" and cells[5].endswith(" ns")


def test_a_slider_changes_the_response(opened):
    page = opened(STATUE)
    slider = page.page.locator("#pga-slider")
    page.rested(lambda: (slider.focus(), slider.press("ArrowRight")))
    level = query_of(page)["pga"]
    assert level != "0.4g"
    response = statue(float(level[:-1]) * 9.80665)
    assert peak_shown(page) == pytest.approx(round_ratio(response), rel=2e-3)
    assert page.js("document.getElementById('pga').value") == level[:-1]
    assert page.js("document.getElementById('pga-slider').getAttribute('aria-valuetext')") == f"{level[:-1]} g"


def test_a_field_takes_units_and_shows_the_number_in_its_own(opened):
    page = opened(STATUE)
    width = page.page.locator("#width")
    for typed, address, shown in (("50 cm", "50 cm", "0.5"), ("1 ft", "1 ft", "0.3048"), ("0,3", "0.3", "0.3")):
        page.rested(lambda: (width.fill(typed), width.press("Enter")))  # noqa: B023
        assert query_of(page)["width"] == address and width.input_value() == shown
        block = rocking.Block(width=float(shown), height=1.1)
        response = rocking.simulate(block, rocking.records.load("ridgecrest-clc-090").scaled_to(0.4 * 9.80665))
        assert peak_shown(page) == pytest.approx(round_ratio(response), rel=2e-3)
        assert f"width={block.half_width * 2!r}" in page.text("#python")


def test_what_is_refused_is_marked_and_leaves_the_last_good_case_in_grey(opened):
    page = opened(STATUE, allowed=["422"])
    width = page.page.locator("#width")
    for typed, good in (("abc", "0.3"), ("-1", "0.31"), ("0.5 kg", "0.32")):
        before, address = page.text("#python"), query_of(page)["width"]
        width.fill(typed)
        width.press("Enter")
        page.until("!document.getElementById('problem').hidden")
        assert width.input_value() == typed and page.js(MARKED) == ["width"]
        assert page.js("document.querySelector('.number[data-problem]').dataset.problem") == page.text("#problem")
        assert page.js("document.getElementById('main').classList.contains('old')")
        assert "last case that could be computed" in page.text("#old") and page.page.locator("#old").is_visible()
        assert query_of(page)["width"] == address and page.text("#python") == before
        page.rested(lambda: (width.fill(good), width.press("Enter")))  # noqa: B023
        assert not page.js("document.getElementById('main').classList.contains('old')")
        assert page.page.locator("#old").is_hidden() and query_of(page)["width"] == good


def test_free_rocking_is_released_from_the_rotation_that_is_shown(opened):
    page = opened(STATUE)
    page.rested(lambda: page.page.select_option("#kind", "none"))
    start = page.page.locator("#initial_rotation")
    assert start.input_value() == "3" and query_of(page)["initial_rotation"] == "3deg"
    response = rocking.simulate(rocking.Block(width=0.24, height=1.1), None, initial_rotation=math.radians(3.0))
    assert peak_shown(page) == pytest.approx(round_ratio(response), rel=2e-3)
    assert page.text("#command").startswith("The command line does not do this case")
    page.rested(lambda: (start.fill("0"), start.press("Enter")))
    assert "initial_rotation" not in query_of(page) and "nothing shakes it" in page.text("#verdict")
    page.rested(lambda: page.page.select_option("#kind", "record"))
    assert "initial_rotation" not in query_of(page) and start.is_hidden()


@pytest.mark.parametrize(
    "more", ["&offset=0.02", *(pytest.param(each, marks=MORE) for each in ("", "&restitution=0.93"))]
)
def test_another_description_is_the_same_block(opened, more):
    page = opened("width=0.237&height=1.103&motion=ridgecrest-clc-090&pga=0.4g" + more)
    impacts = page.text("#figures div:nth-child(3) dd")
    for shape in ("parameters", "pivots", "parameters", "sizes"):
        page.rested(lambda: page.page.select_option("#shape", shape))  # noqa: B023
        assert page.text("#figures div:nth-child(3) dd") == impacts, shape
    assert page.page.locator("#housner").is_checked() == ("restitution" not in more)
    found = query_of(page)
    assert (
        float(found["width"]) == pytest.approx(0.237, rel=1e-14)
        and page.page.locator("#width").input_value() == "0.237"
    )


def test_a_number_that_is_being_typed_stays_when_a_response_arrives(opened):
    page = opened(STATUE)
    width, move = page.page.locator("#width"), "document.getElementById('pga-slider')"
    moved = f"{move}.value = '700'; {move}.dispatchEvent(new Event('input', {{bubbles: true}}))"
    page.rested(lambda: (page.js(moved), width.fill("0.3")))
    assert query_of(page)["pga"] != "0.4g" and query_of(page)["width"] == "0.24"
    assert width.input_value() == "0.3"
    page.rested(lambda: width.press("Enter"))
    assert query_of(page)["width"] == "0.3" and "α = 15.3°" in page.text("#derived")


def test_a_link_reproduces_what_is_shown(opened):
    query = STATUE + "&model=linear&chattering=velocity%3D0.001&from=231&to=234"
    page = opened(query)
    again = query_of(page)
    assert again == {
        "width": "0.24",
        "height": "1.1",
        "motion": "ridgecrest-clc-090",
        "pga": "0.4g",
        "model": "linear",
        "chattering": "velocity=0.001",
        "from": "231",
        "to": "234",
    }
    assert page.js("[document.getElementById('model').value, document.getElementById('treatment').value]") == [
        "linear",
        "velocity",
    ]
    block = rocking.Block(width=0.24, height=1.1)
    motion = rocking.records.load("ridgecrest-clc-090").scaled_to(0.4 * 9.80665)
    response = rocking.simulate(block, motion, model="linear", chattering="velocity=0.001")
    assert peak_shown(page) == pytest.approx(round_ratio(response), rel=2e-3)


@pytest.mark.parametrize(("seed", "count"), [(7, 2), pytest.param(8, 24, marks=MORE)])
def test_whatever_an_address_says_the_page_has_no_fault(opened, here, seed, count):
    page, draw, told = opened(allowed=["422", "404"]), random.Random(seed), 0
    corners = [{"width": "0.24", "height": "1.1", "motion": "none"}, {"from": "0", "to": "1e-300"}]
    corners += [
        {"example": "constructor", "step": "-1"},
        {"motion": "constructor"},
        {"chattering": "toString=1"},
        {"view": "compare", "compare": "toString"},
    ]
    for texts in [*corners, *(explorer_addresses.case(draw) | explorer_addresses.shown(draw) for _ in range(count))]:
        page.page.goto(here.link(texts))
        page.until("document.body.dataset.ready", texts)
        page.until("document.body.dataset.rested || !document.getElementById('problem').hidden", texts)
        assert "has a fault" not in (page.text("#problem") or ""), texts
        told += page.js("!document.getElementById('problem').hidden")
    assert 0.25 * (count + 6) <= told <= 0.9 * (count + 6)


def plotted(page, name="first", where="histories"):
    """Times and heights of a line as it is plotted, the times in s."""
    return page.js(
        """([where, name]) => {
          const sources = Bokeh.documents.map((each) => each.get_model_by_name(`${where}-${name}`)).filter(Boolean);
          const {origin, unit} = document.getElementById(where).dataset;
          const {x, y} = sources[0].data;
          return {origin: Number(origin), unit: Number(unit), x: Array.from(x), y: Array.from(y)};
        }""",
        [where, name],
    )


@pytest.mark.parametrize("width", [10.0, pytest.param(1e-2, marks=MORE), pytest.param(1e-6, marks=MORE), 1e-9])
def test_a_zoom_shows_the_engines_own_values(opened, width):
    response = statue(0.4 * 9.80665)
    middle = float(response.impacts["time"][-30])
    page = opened(f"{STATUE}&from={middle - 0.5 * width!r}&to={middle + 0.5 * width!r}")
    line = plotted(page)
    assert len(line["x"]) > 500
    times = line["origin"] + np.array(line["x"]) * line["unit"]
    assert times[-1] - times[0] == pytest.approx(width, rel=1e-3)
    expected = response.rotation(times) / response.block.alpha
    # The time at which the engine is asked is off by an ulp of 240 s; what is plotted is not.
    slack = 3e-14 * np.abs(response.angular_velocity(times)).max() / response.block.alpha
    assert np.abs(np.array(line["y"]) - expected).max() <= 2.0 * slack + 1e-16


def test_ten_times_closer_again_and_again(opened):
    page = opened(STATUE)
    response = statue(0.4 * 9.80665)
    rest = float(response.sequences["end"][-1])
    for _ in range(12):
        before = page.text("#depth")
        page.page.click("#deeper")
        page.until(f"document.getElementById('depth').textContent !== {before!r}")
    found = query_of(page)
    assert float(found["from"]) < rest < float(found["to"])
    assert float(found["to"]) - float(found["from"]) < 2e-10
    assert "summed by the proof" in page.text("#depth")
    page.page.click("[data-zoom=active]")
    page.until("!new URLSearchParams(location.search).has('from')")


def test_the_phase_plane_and_the_energy_are_drawn_where_they_are_seen(opened):
    page = opened(f"{STATUE}&from=231&to=235&at=232.5", viewport={"width": 1280, "height": 700})
    assert page.js("document.body.dataset.phases") is None
    page.page.locator("#phase-legend").scroll_into_view_if_needed()
    page.until("document.body.dataset.phases === '1'")
    response = statue(0.4 * 9.80665)
    line = page.js(
        f"({MODELS}).filter((each) => each.name === 'phase-total').map((each) => Array.from(each.data.y))[0]"
    )
    times = np.linspace(231.0, 235.0, 4001)
    assert max(line) == pytest.approx(
        (response.kinetic_energy(times) + response.potential_energy(times)).max(), rel=1e-3
    )
    now = page.js(
        f"({MODELS}).filter((each) => each.name === 'phase-now').map(({{data}}) => [data.x[0], data.y[0]])[0]"
    )
    block, (theta, rate, _) = response.block, response.states(232.5)
    assert now == pytest.approx([theta / block.alpha, rate / (block.p * block.alpha)], abs=1e-4)
    slider = page.page.locator("#pga-slider")
    page.page.evaluate("scrollTo(0, 0)")
    page.rested(lambda: (slider.focus(), slider.press("ArrowRight")))
    assert page.js("document.body.dataset.phases") == "1"


def test_a_time_is_read_by_mouse_by_keys_and_typed_and_the_block_follows(opened):
    page = opened(f"{STATUE}&from=231&to=235", allowed=["422"])
    response = statue(0.4 * 9.80665)
    assert page.text("#cursor").startswith("Click on the plots")

    def read(time):
        page.until(f"Math.abs(Number(document.getElementById('cursor').dataset.time) - {time}) < 1e-9")
        assert float(query_of(page)["at"]) == pytest.approx(time, abs=1e-12)
        degrees = page.text("#cursor").split("rotation ")[1].split("°")[0].replace("−", "-")
        assert float(degrees) == pytest.approx(math.degrees(response.rotation(time)), rel=6e-3)

    field, slider, plots = (page.page.locator(name) for name in ("#at", "#at-slider", "#histories"))
    field.fill("232500 ms")
    field.press("Enter")
    read(232.5)
    plots.focus()
    plots.press("Shift+ArrowRight")
    read(232.52)
    slider.focus()
    slider.press("ArrowLeft")
    read(232.516)
    page.until("document.getElementById('said').textContent.startsWith('At 232.516 s')")
    field.fill("1e9")
    field.press("Enter")
    page.until("document.getElementById('at').getAttribute('aria-invalid') === 'true'")
    assert "must be within the response" in page.text("#problem")
    box = plots.bounding_box()
    page.page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 100)
    page.until("document.getElementById('problem').hidden")
    clicked = float(query_of(page)["at"])
    assert 232.0 < clicked < 234.0
    page.page.click("[data-view=block]")
    page.until(f"Math.abs(Number(document.getElementById('stage').dataset.shown) - {clicked}) < 1e-9")
    page.page.locator("#scrub").press("End")
    read(235.0)


def test_keys_move_and_zoom_the_plots(opened):
    page = opened(f"{STATUE}&from=231&to=235")
    plots = page.page.locator("#histories")
    plots.focus()
    plots.press("+")
    page.until("new URLSearchParams(location.search).get('from') === '232'")
    plots.press("ArrowRight")
    page.until("new URLSearchParams(location.search).get('from') === '232.5'")
    plots.press("-")
    page.until("new URLSearchParams(location.search).get('from') === '231.5'")
    plots.press("0")
    page.until("!new URLSearchParams(location.search).has('from')")


def test_dragging_across_a_plot_zooms_in(opened):
    page = opened(f"{STATUE}&from=230&to=240")
    box = page.page.locator("#histories").bounding_box()
    page.page.mouse.move(box["x"] + 0.4 * box["width"], box["y"] + 100)
    page.page.mouse.down()
    page.page.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + 120, steps=4)
    page.page.mouse.up()
    page.until(
        "((given) => Number(given.get('to')) - Number(given.get('from')) < 3)(new URLSearchParams(location.search))"
    )
    page.page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 110, steps=2)
    page.says("cursor", "the block")


def test_a_reading_is_of_the_case_and_of_the_time_that_are_shown(opened):
    page = opened(STATUE, allowed=["422"])
    problem = "!document.getElementById('problem').hidden"
    entered(page, "at", "9999")
    page.until(problem)
    page.rested(lambda: page.page.select_option("#record", "el-centro-meloland-270"))
    assert not page.js(problem) and page.page.input_value("#at") == ""
    entered(page, "at", "2")
    page.says("cursor", "At 2.0")
    page.rested(lambda: page.page.select_option("#record", "ridgecrest-clc-090"))
    assert page.page.input_value("#at") == "" and page.text("#cursor").startswith("Click on the plots")
    # What the pointer asked for comes when it has left the plots.
    box = page.page.locator("#histories").bounding_box()
    with held(page, "**/api/at?*") as waiting:
        page.page.mouse.move(box["x"] + 400, box["y"] + 80)
        asked(page, waiting)
        page.page.mouse.move(box["x"] + 400, box["y"] - 60)
        page.paused(100)
    page.paused(300)
    assert page.text("#cursor").startswith("Click on the plots")


def test_all_numbers_in_words(opened):
    page = opened(STATUE)
    page.page.click("#in-words summary")
    page.until("document.querySelectorAll('#words tr').length > 5")
    expected = statue(0.4 * 9.80665).summary().splitlines()
    found = page.js(
        "Array.from(document.querySelectorAll('#words tr'), (row) => Array.from(row.cells, (cell) => cell.textContent))"
    )
    assert found == [[line[:20].strip(), line[20:].strip()] for line in expected]


# Ways in


def test_a_pulse_is_chosen_and_changed(opened):
    page = opened(STATUE)
    page.rested(lambda: page.page.select_option("#kind", "pulse"))
    page.rested(lambda: page.page.select_option("#pulse", "ricker"))
    page.rested(lambda: page.page.select_option("#pulse-kind", "antisymmetric"))
    amplitude = page.page.locator("#pulse-amplitude")
    page.rested(lambda: (amplitude.fill("0.35"), amplitude.press("Enter")))
    assert query_of(page)["motion"] == "ricker:amplitude=0.35g,frequency=1g,kind=antisymmetric".replace("1g", "1")
    response = rocking.simulate(
        rocking.Block(width=0.24, height=1.1), rocking.pulses.ricker(0.35 * 9.80665, 1.0, kind="antisymmetric")
    )
    assert page.text("#figures div:first-child dd").startswith("overturns") == response.overturned


def test_a_pulse_of_an_address_is_read_as_the_package_reads_it(opened):
    loose = urlencode({"motion": "sine: amplitude=0.3g, frequency = 2Hz, cycles=5 ,"})
    page = opened(f"width=0.24&height=1.1&{loose}&view=map&points=8")
    complete(page)
    shown = {name: page.page.input_value(f"#pulse-{name}") for name in ("amplitude", "frequency", "cycles")}
    assert shown == {"amplitude": "0.3", "frequency": "2", "cycles": "5"}
    assert page.page.input_value("#map-x") == "omega" and page.page.input_value("#map-y") == "a"
    assert "--cycles 5" in page.text("#command") or "rocking map" not in page.text("#command")
    page.rested(lambda: page.page.click("#map-open"))
    motion = query_of(page)["motion"]
    assert motion.startswith("sine:amplitude=") and motion.endswith(",cycles=5")


def test_a_block_by_its_parameters_with_two_sides(opened):
    page = opened(STATUE)
    page.rested(lambda: page.page.select_option("#shape", "parameters"))
    page.rested(lambda: page.page.check("#two"))
    left = page.page.locator("#\\31 alpha")
    page.rested(lambda: (left.fill("9"), left.press("Enter")))
    found = query_of(page)
    assert found["alpha"].endswith(",9deg")
    block = rocking.Block.from_parameters(
        [float(each) for each in found["p"].split(",")],
        [quantities.read_angle(each, "alpha") for each in found["alpha"].split(",")],
        [float(each) for each in found["restitution"].split(",")],
    )
    response = rocking.simulate(block, rocking.records.load("ridgecrest-clc-090").scaled_to(0.4 * 9.80665))
    assert page.text("#figures div:first-child dd").startswith("overturns") == response.overturned


def test_a_block_off_its_middle_is_described_by_its_pivots_as_well(opened):
    page = opened(STATUE)
    offset = page.page.locator("#offset")
    page.rested(lambda: (offset.fill("0.03"), offset.press("Enter")))
    assert query_of(page)["offset"] == "0.03"
    assert page.text("#derived").startswith("To the right p = ")
    page.rested(lambda: page.page.select_option("#shape", "pivots"))
    found = query_of(page)
    assert [float(each) for each in found["pivots"].split(",")] == pytest.approx([0.09, 0.15], rel=1e-3)
    assert "width" not in found and "restitution" not in found
    block = rocking.Block.from_pivots(
        [float(each) for each in found["pivots"].split(",")], float(found["height_of_mass"]), float(found["gyration"])
    )
    response = rocking.simulate(block, rocking.records.load("ridgecrest-clc-090").scaled_to(0.4 * 9.80665))
    assert page.text("#figures div:first-child dd").startswith("overturns") == response.overturned


def test_a_record_is_scaled(opened):
    page = opened(STATUE)
    sa = rocking.Measure("sa", 1.0)
    for kind, value, target in (
        ("pgv", "0.25", (0.25, "pgv")), ("sa", "0.6", (0.6 * 9.80665, sa)), ("scale", "1.3", (1.3, "factor")),
    ):  # fmt: skip
        page.rested(lambda: page.page.select_option("#scaled", kind))  # noqa: B023
        page.rested(lambda: (page.page.fill(f"#{kind}", value), page.page.press(f"#{kind}", "Enter")))  # noqa: B023
        response = statue(*target)
        shown = page.text("#figures div:first-child dd")
        if response.overturned:
            assert shown.startswith("overturns")
        else:
            assert peak_shown(page) == pytest.approx(round_ratio(response), rel=2e-3)


def test_a_file_is_chosen_told_about_and_shown(opened, tmp_path):
    samples = rocking.records.load("el-centro-meloland-270").samples
    file = tmp_path / "station 7.txt"
    file.write_text("\n".join(f"{value / 9.80665:.12g}" for value in samples), "utf-8")
    page = opened(STATUE, allowed=["422"])
    before = page.text("#python")
    page.page.set_input_files("#file", file)
    page.until("document.getElementById('main').classList.contains('old')", "nothing is computed before units and step")
    said = page.page.locator(".missing button").all_text_contents()
    record = rocking.records.load("el-centro-meloland-270")
    assert f"g: PGA {record.pga / 9.80665:.3g} g" in said
    assert f"m/s2: PGA {record.pga / 9.80665**2:.3g} g" in said
    assert f"0.01 s: it lasts {record.duration:.4g} s" in said and len(said) == 10
    assert "motion=ridgecrest" in page.page.url and page.text("#python") == before
    page.page.locator(".missing button", has_text="0.02 s").click()
    page.until("document.querySelectorAll('.missing button').length === 6")
    assert page.page.locator("#dt").input_value() == "0.02" and page.text("#python") == before
    page.rested(lambda: page.page.locator(".missing button", has_text="m/s2: PGA").first.click())
    assert {"dt": "0.02", "units": "m/s2"}.items() <= query_of(page).items()
    page.rested(lambda: (page.page.locator("#dt").fill("0.01"), page.page.locator("#dt").press("Enter")))
    page.rested(lambda: page.page.select_option("#units", "g"))
    response = rocking.simulate(rocking.Block(width=0.24, height=1.1), record)
    assert ("overturns" in page.text("#verdict")) == response.overturned
    assert "'station 7.txt'" in page.text("#python") and page.page.locator(".missing").is_hidden()


DROP = """async ([name, text]) => {
  const given = new DataTransfer();
  given.items.add(new File([text], name));
  for (const kind of ['dragenter', 'dragover', 'drop'])
    document.querySelector('main').dispatchEvent(
      new DragEvent(kind, {dataTransfer: given, bubbles: true, cancelable: true}));
}"""


HOSTILE = ["x<img src=x id=hostile onerror=alert(1)>", '"><style id=hostile>*{display:none}', "$$hostile{$$"]


@MORE
def test_names_of_files_and_channels_are_shown_as_they_are_written(opened):
    page = opened(STATUE)
    channels = ["a", "&amp;&lt;b&gt;", "$$\\hostile{$$"]
    rows = "".join(f"{0.01 * k:.2f},{0.3 * (-1) ** (k // 20)},0.1,0.2\n" for k in range(100))
    text = "time (s)," + ",".join(f"{name} (g)" for name in channels) + "\n" + rows
    for k, name in enumerate(HOSTILE):
        page.rested(lambda name=name, k=k: page.js(DROP, [name, f"{text}1.{k},0,0,0\n"]))
        shown = page.js("Array.from(document.getElementById('channel').options, (each) => each.textContent)")
        assert len(shown) == 3 and all(channel in each for channel, each in zip(channels, shown, strict=True))
        for where, written in (("python", repr(name)), ("command", shlex.quote(name))):
            page.until(f"document.getElementById('{where}').textContent.includes({json.dumps(written)})")
        for view in VIEWS:
            page.page.click(f"[data-view={view}]")
            page.paused(150)
        assert page.js("document.getElementById('hostile')") is None
        page.rested(lambda: page.page.click("[data-view=response]"))


def test_a_file_of_several_channels_is_dropped(opened):
    page = opened(STATUE)
    text = (Path(__file__).parent / "data" / "formats" / "two.v2").read_text("latin-1")
    page.rested(lambda: page.js(DROP, ["two.v2", text]))
    assert page.js("document.getElementById('channel').options.length") == 2
    assert query_of(page)["motion"].startswith("file:")
    page.rested(lambda: page.page.select_option("#channel", index=1))
    assert query_of(page)["channel"] == "2"
    page.page.reload()
    page.until("document.getElementById('channel')?.value === '2'", "a link with a file shows its channels")
    assert page.js("document.getElementById('vertical').options[1].textContent").startswith("channel 1")


def test_a_link_whose_file_is_opened_again_is_the_same_case(opened, explorer):
    record = rocking.records.load("el-centro-meloland-270")
    text = "\n".join(f"{value:.9g}" for value in record.samples)
    key = hashlib.sha256(text.encode()).hexdigest()[:24]
    link = f"width=0.24&height=1.1&motion=file:{key}&vertical=ridgecrest-clc-up&dt=0.01&units=m/s2&pga=0.4g"
    page = opened(STATUE, allowed=["422"])
    page.page.goto(page.page.url.split("?")[0] + "?" + link)
    page.until("!document.getElementById('problem').hidden", "the file is not here")
    page.rested(lambda: page.js(DROP, ["again.txt", text]))
    found = {"motion": f"file:{key}", "vertical": "ridgecrest-clc-up", "dt": "0.01", "units": "m/s2", "pga": "0.4g"}
    assert found.items() <= query_of(page).items()
    assert page.js("['scaled', 'pga', 'dt', 'units', 'vertical'].map((id) => document.getElementById(id).value)") == [
        "pga", "0.4", "0.01", "m/s2", "ridgecrest-clc-up",
    ]  # fmt: skip
    assert page.text("#python").count("scaled_to(") == 1 and "dt=0.01, units='m/s2'" in page.text("#python")


MESH = "mesh=statue&azimuth=30&motion=ridgecrest-clc-090&pga=0.6g"
PLAN = "document.querySelector('.plan path.plan-rose')"
INK = """() => { const {data} = document.getElementById('stage').getContext('2d').getImageData(0, 0, 2000, 360);
  let count = 0;
  for (let k = 3; k < data.length; k += 4) count += data[k - 3] === 0xcf && data[k - 2] === 0xc6;
  return count; }"""


def test_a_body_is_seen_from_above_and_turned(opened, explorer):
    page = opened(MESH, allowed=["willReadFrequently"])
    page.until(PLAN, "the plan is drawn")
    assert "Towards 30°" in page.text("#derived") and "Towards 210°" in page.text("#derived")
    assert "lifted first towards 90°, above 0.282 g" in page.text(".body")
    assert "Planar rocking leaves out" in page.text(".body") and "Nothing had to be repaired" in page.text(".body")
    plan = page.page.locator(".plan").bounding_box()
    page.rested(lambda: page.page.locator(".plan").click(position={"x": 0.95 * plan["width"], "y": plan["height"] / 2}))
    assert query_of(page)["azimuth"] == "90"
    assert page.js("document.getElementById('azimuth').value") == "90"
    page.rested(lambda: page.page.locator("#azimuth-slider").press("ArrowRight"))
    assert query_of(page)["azimuth"] == "91"
    side = explorer.case({**dict(parse_qsl(MESH)), "azimuth": "91"}).header["block"]["sides"][0]
    assert f"p = {side['p']:.3g} rad/s, α = {math.degrees(side['alpha']):.3g}°" in page.text("#derived")
    assert ".block(91.0)" in page.text("#python") and "--pivots" in page.text("#command")
    page.page.click("[data-view=block]")
    page.until("document.getElementById('stage').dataset.shown")
    statue_ink = page.js(INK)
    page.rested(lambda: page.page.select_option("#shape", "pivots"))
    assert statue_ink > 0
    page.until(f"0.9 * ({INK})() > {statue_ink}", "the whole block is drawn")
    assert page.js("document.querySelector('.plan').checkVisibility()") is False


@MORE
def test_a_mesh_is_dropped_read_otherwise_and_opened_again_by_its_link(opened, explorer):
    page = opened(STATUE, allowed=["422"])
    text = trimesh.exchange.obj.export_obj(trimesh.creation.box((200, 400, 1000)))
    page.rested(lambda: page.js(DROP, ["my scan.OBJ", text]))
    key = hashlib.sha256(text.encode()).hexdigest()[:24]
    assert query_of(page)["mesh"] == f"file:{key}" and float(query_of(page)["azimuth"]) % 180 == 90
    assert "the body is 1000 m high" in page.text("#notes")
    page.page.click("summary:has-text('How the mesh is read')")
    page.rested(lambda: page.page.select_option("#unit", "mm"))
    assert "p = 3.8 rad/s, α = 11.3°" in page.text("#derived")
    assert "Solid.from_mesh('my scan.OBJ', unit='mm').block(" in page.text("#python")
    link = query_of(page)
    explorer.uploads._files.clear()
    page.page.goto(
        page.page.url.split("?")[0] + f"?mesh=file:{key}&azimuth=0&unit=mm&motion=none&initial_rotation=2deg"
    )
    page.until("!document.getElementById('problem').hidden", "the mesh is not here")
    assert page.text("#problem") == "this mesh is not here any more: drop its file on the page again"
    page.rested(lambda: page.js(DROP, ["again.obj", text]))
    assert {"mesh": link["mesh"], "azimuth": "0", "unit": "mm", "motion": "none"}.items() <= query_of(page).items()
    page.js(DROP, ["broken.ply", "ply"])
    page.until("document.getElementById('problem').textContent.startsWith('broken.ply: cannot be read')")
    assert query_of(page)["mesh"] == link["mesh"]


def test_a_record_shakes_upwards_as_well(opened):
    page = opened(STATUE, allowed=["422"])
    assert "vertical" not in page.text("#legend")
    page.rested(lambda: page.page.select_option("#vertical", "ridgecrest-clc-up"))
    assert query_of(page)["vertical"] == "ridgecrest-clc-up"
    upwards = rocking.records.load("ridgecrest-clc-up")
    motion = rocking.records.load("ridgecrest-clc-090").with_vertical(upwards).scaled_to(0.4 * 9.80665)
    response = rocking.simulate(rocking.Block(width=0.24, height=1.1), motion)
    assert peak_shown(page) == pytest.approx(round_ratio(response), abs=6e-4)
    assert "vertical acceleration (ridgecrest-clc-up" in page.text("#legend")
    assert "--vertical ridgecrest-clc-up" in page.text("#command")
    assert "with_vertical(rocking.records.load('ridgecrest-clc-up'))" in page.text("#python")
    page.rested(lambda: page.page.select_option("#record", "ridgecrest-clc-360"))
    assert "vertical" not in query_of(page)


def test_a_broken_file_is_answered_with_a_sentence(opened):
    page = opened(STATUE, allowed=["422"])
    page.js(DROP, ["broken.at2", "PEER NGA\nheading\nnothing\nNPTS= 100, DT= .01 SEC\n 0.1 0.2 x\n"])
    page.until("!document.getElementById('problem').hidden")
    assert page.text("#problem").startswith("broken.at2")
    assert page.text("#verdict").startswith("It stays up")
    assert page.page.locator("#old").is_hidden() and page.js(GREY) == []
    page.rested(lambda: page.js(DROP, ["whole.csv", ROWS]))
    page.until("document.getElementById('problem').hidden")


# Ways out


def test_the_copied_command_and_the_script_have_the_same_peak(opened, tmp_path):
    page = opened(
        "width=0.3&height=1.2&motion=ridgecrest-clc-090&pga=0.45g&model=linear",
        permissions=["clipboard-read", "clipboard-write"],
    )
    page.page.click("[data-copy=command]")
    page.until("document.querySelector('[data-copy=command]').textContent === 'Copied'")
    command = shlex.split(page.js("navigator.clipboard.readText()"))
    code = "import sys; from rocking.cli import main; main(sys.argv[1:])"
    ran = subprocess.run(
        [sys.executable, "-c", code, *command[1:], "--json"], capture_output=True, text=True, check=True
    )
    script = tmp_path / "case.py"
    script.write_text(page.text("#python") + "\nprint(response.peak_rotation)\n", "utf-8")
    printed = subprocess.run([sys.executable, script], capture_output=True, text=True, check=True).stdout
    peak = json.loads(ran.stdout)["peak_rotation_rad"]
    assert float(printed.splitlines()[-1]) == peak
    assert peak_shown(page) == pytest.approx(json.loads(ran.stdout)["peak_over_slenderness"], rel=2e-3)


# The block


def test_the_block_plays_and_stops_in_step_with_the_plots(opened):
    page = opened(f"view=block&{STATUE}")
    seconds = "Number(document.getElementById('clock').textContent.replace(' s', ''))"
    start = page.js(seconds)
    picture = "document.getElementById('stage').toDataURL()"
    before = page.js(picture)
    page.page.select_option("#speed", "2")
    page.page.uncheck("#slow")
    page.page.click("#play")
    page.until(f"{seconds} > {start} + 1.5")
    page.page.click("#play")
    assert page.text("#play") == "Play"
    assert page.js(picture) != before
    time = page.js(seconds)
    spans = page.js(f"""() => {MODELS}
        .filter((each) => each.type === 'Span' && each.dimension === 'height' && each.visible)
        .map((each) => each.location)""")
    assert len(spans) == 2
    assert spans == pytest.approx([time, time], abs=0.02)


def test_the_block_is_scrubbed_to_a_time_and_says_its_rotation(opened):
    page = opened(f"view=block&{STATUE}&from=232&to=233")
    page.js(
        """() => {
          const scrub = document.getElementById('scrub');
          scrub.value = 6691;
          scrub.dispatchEvent(new Event('input'));
        }"""
    )
    page.until("document.getElementById('clock').textContent.startsWith('232.669')")
    assert page.js("document.getElementById('scrub').getAttribute('aria-valuetext')").startswith("232.669")
    page.page.click("#to-rest")
    page.until("Number(document.getElementById('clock').textContent.replace(' s', '')) > 235")


# The map


def complete(page, axes=""):
    page.until("document.body.dataset.map === 'complete'", f"the map is complete {axes}", timeout=240.0)


def test_a_map_is_drawn_and_a_click_opens_the_case(opened):
    page = opened(f"view=map&{SINE}&points=48&x=omega&x_from=1&x_to=4&y=a&y_from=1&y_to=1.1")
    complete(page)
    assert "complete" in page.text("#map-legend")
    assert "exact critical amplitude" in page.text("#map-legend")
    box = page.page.locator("#map").bounding_box()
    page.page.mouse.move(box["x"] + 0.5 * box["width"], box["y"] + 0.8 * box["height"])
    page.says("map-at", "complete")
    page.rested(lambda: page.page.mouse.click(box["x"] + 0.5 * box["width"], box["y"] + 0.8 * box["height"]))
    found = query_of(page)
    assert "view" not in found
    numbers = dict(part.split("=") for part in found["motion"].split(":")[1].split(","))
    block = rocking.Block.from_parameters(2.0, 0.2, 0.92)
    omega, a = (
        2.0 * math.pi * float(numbers["frequency"]) / 2.0,
        float(numbers["amplitude"]) / (9.80665 * math.tan(0.2)),
    )
    assert 2.0 < omega < 3.0
    assert 1.0 < a < 1.03
    response = rocking.simulate(block, sine(block)(a, omega).motion)
    assert peak_shown(page) == pytest.approx(round_ratio(response), rel=2e-3)


def test_a_map_is_read_by_keys_and_by_another_quantity(opened):
    page = opened(f"view=map&{SINE}&points=24&quantity=rest&x=restitution&y=omega")
    complete(page)
    page.page.locator("#map").focus()
    before = page.text("#map-at")
    page.page.keyboard.press("Shift+ArrowUp")
    page.page.keyboard.press("ArrowRight")
    assert page.text("#map-at") != before
    assert "rests" in page.text("#map-at")
    page.page.select_option("#map-quantity", "peak")
    complete(page, "by peak")
    page.rested(lambda: page.page.keyboard.press("Enter") if page.page.locator("#map").focus() is None else None)
    assert "restitution" in query_of(page)


def test_a_map_is_zoomed_by_a_rectangle_and_by_keys_and_back(opened):
    page = opened(SINE + "&view=map&x=omega&y=a&y_from=1&y_to=1.1&points=8")
    complete = "document.body.dataset.map === 'complete'"
    page.until(complete)
    box = page.page.locator("#map").bounding_box()
    x, y = box["x"] + 0.4 * box["width"], box["y"] + 0.3 * box["height"]
    page.page.mouse.move(x, y)
    page.page.mouse.down()
    page.page.mouse.move(x + 120, y + 100, steps=5)
    assert page.page.locator("#map-small").is_hidden()
    page.page.mouse.up()
    page.until("document.body.dataset.map === 'running' || Number(document.getElementById('map-x-from').value) > 0.5")
    page.until(complete)
    found = {name: float(query_of(page)[name]) for name in ("x_from", "x_to", "y_from", "y_to")}
    assert 0.5 < found["x_from"] < found["x_to"] < 8.0 and found["x_to"] - found["x_from"] < 2.5
    assert 1.0 < found["y_from"] < found["y_to"] < 1.1
    shown = page.js(f"({MODELS}).filter((each) => each.type === 'ImageRGBA').length")
    assert shown == 1 and page.js("document.getElementById('map-x-from').value") == query_of(page)["x_from"]
    plots = page.page.locator("#map")
    plots.focus()
    plots.press("+")
    page.until(f"Number(document.getElementById('map-x-from').value) > {found['x_from']}")
    page.until(complete)
    plots.press("-")
    page.until(f"Number(document.getElementById('map-x-from').value) === {found['x_from']}")
    page.until(complete)
    page.page.click("#map-out")
    page.until("document.getElementById('map-y-to').value === '1.1'")
    page.until(complete)


def test_a_small_response_is_shown_where_the_pointer_lies_still(opened, explorer):
    page = opened(SINE + "&view=map&x=omega&y=a&y_from=1&y_to=1.1&points=8")
    page.until("document.body.dataset.map === 'complete'")
    asked = []
    page.page.on("request", lambda request: asked.append(request.url) if "/api/map/response" in request.url else None)
    box = page.page.locator("#map").bounding_box()
    for k in range(8):  # on the way nothing is asked for
        page.page.mouse.move(box["x"] + 120 + 40 * k, box["y"] + 120)
    small = page.page.locator("#map-small")
    small.wait_for(state="visible", timeout=20_000)
    # A loaded machine may rest on the way.
    assert 1 <= len(asked) < 8
    x, y = map(float, small.get_attribute("data-at").split(","))
    grid = {"x": "omega", "y": "a", "y_from": "1", "y_to": "1.1", "points": "8"}
    case = read_case(dict(parse_qsl(SINE)), explorer.uploads)
    verdict = explorer.case(maps.map_point_to_texts(maps.read_grid(case, grid), x, y)).header["verdict"]
    assert page.text("#map-small p").startswith(in_english(verdict))


def test_a_map_has_the_units_of_the_page_and_its_address_those_of_the_axes(opened):
    query = f"{STATUE}&view=map&points=9&x=alpha&x_from=5&x_to=25&y=pga&y_from=0.1&y_to=0.9"
    page = opened(f"{query}&angle_in=rad&acceleration_in=m/s2", allowed=["422"])
    complete(page)
    assert "α = 0.262 rad, Peak ground acceleration = 4.9 m/s²" in page.text("#map-at")
    label = "document.getElementById('map-{}').selectedOptions[0].text"
    assert page.js(label.format("x")) == "Slenderness α (rad)"
    assert page.js(label.format("y")) == "Peak ground acceleration (m/s²)"
    labels = page.js(f"{MODELS}.filter((each) => each.type === 'LinearAxis').map((each) => each.axis_label)")
    assert {"Slenderness α (rad)", "Peak ground acceleration (m/s²)"} <= {*labels}
    ranges = page.js(f"{MODELS}.find((each) => each.type === 'Figure').x_range.end")
    assert ranges == pytest.approx(math.radians(25 + 20 / 16))
    assert float(page.page.input_value("#map-y-to")) == pytest.approx(0.9 * 9.80665, rel=1e-5)
    entered(page, "map-y-to", "7.845320")
    page.until("new URLSearchParams(location.search).get('y_to') === '0.8'")
    complete(page)
    page.rested(lambda: page.page.click("#map-open"))
    found = query_of(page)
    assert quantities.read_acceleration(found["pga"], "pga") == pytest.approx(0.5375 * 9.80665)


def test_a_map_is_taken_away_and_computed_again(opened, tmp_path):
    page = opened(f"view=map&{SINE}&points=8&x=omega&x_from=1&x_to=4&y=a&y_from=1&y_to=8&quantity=mode")
    complete(page)
    assert page.text("#python-title") == "This map as Python"
    saved = {}
    for name in ("rocking-map.svg", "rocking-map.png", "rocking-map.csv"):
        with page.page.expect_download() as download:
            page.page.get_by_role(
                "button", name={"csv": "Numbers, CSV"}.get(name[-3:], f"Figure, {name[-3:].upper()}")
            ).click()
        assert download.value.suggested_filename == name
        saved[name[-3:]] = Path(download.value.path()).read_bytes()
    assert saved["png"].startswith(b"\x89PNG")
    assert b"<svg" in saved["svg"][:200]
    lines = saved["csv"].decode().splitlines()
    key = [line for line in lines if line.startswith("#")]
    assert key[0].startswith("# outcome: 0 ") and "; 1 complete" in key[0]
    assert [line.split(":")[0] for line in key] == ["# outcome", "# rest", "# peak", "# mode"]
    assert "-1 rocks" in key[3] and "n overturns after n impacts" in key[3]
    table = np.genfromtxt(lines[len(key) :], delimiter=",", names=True)
    assert table.dtype.names == ("omega", "a", "outcome", "rest", "peak", "mode")
    script = tmp_path / "map.py"
    script.write_text(page.text("#python"), "utf-8")
    ran = runpy.run_path(str(script))
    assert np.array_equal(np.unique(table["omega"]), ran["xs"])
    assert np.array_equal(table["mode"].reshape(8, 8), ran["found"])
    page.page.select_option("#map-quantity", "outcome")
    page.says("python", "chattering_map")
    page.page.click("[data-view=response]")
    page.until("document.getElementById('python-title').textContent === 'This case as Python'")


def test_a_map_of_a_record_opens_on_the_final_fate_and_hatches_what_falls_later(opened, explorer):
    page = opened("view=map&width=0.24&height=1.1&motion=el-centro-meloland-270&points=40&y_from=0.1&y_to=2")
    page.until("document.body.dataset.map === 'complete'", timeout=120)
    assert page.page.locator("#map-quantity").input_value() == "mode"
    texts = {"width": "0.24", "height": "1.1", "motion": "el-centro-meloland-270"}
    axes = {"x": "p", "x_from": "1", "x_to": "6", "y": "pga", "y_from": "0.1", "y_to": "2", "points": "40"}
    found = [part.values for part in maps.simulate_grid(maps.read_grid(read_case(texts, explorer.uploads), axes))]
    outcome, mode = np.concatenate(found, axis=1)[[0, 3]]
    falls, at_once = (mode >= 0) | (mode == -4), outcome == 4
    shares = [as_number(each) for each in re.findall(r"overturns [^,]*, (\S+) %", page.text("#map-legend"))]
    assert sum(shares) == pytest.approx(100 * falls.mean(), rel=0.05) and len(shares) >= 2
    assert page.text("#map-y option:checked") == "Peak ground acceleration (g)"
    assert re.match(
        r"Frequency parameter p = 3\.\d+ rad/s, Peak ground acceleration = 1\.\d+ g: ", page.text("#map-at")
    )
    page.page.select_option("#map-quantity", "outcome")
    page.says("map-legend", "hatched: overturns later")
    assert "End of the first rocking" in page.text("#map-quantity option:checked")
    (later,) = re.findall(r"hatched: overturns later, ([\d.]+) %", page.text("#map-legend"))
    assert float(later) == pytest.approx(100 * (falls & ~at_once).mean(), rel=0.05) and float(later) > 1.0


def test_a_study_opens_as_a_map(browser, opened, tmp_path_factory):
    folder = tmp_path_factory.mktemp("study") / "museum"
    blocks = rocking.Blocks.grid(p=np.linspace(2.0, 5.0, 12), alpha=np.linspace(0.1, 0.3, 10), restitution=[0.9])
    made = rocking.create_study(
        folder,
        blocks,
        rocking.records.load("el-centro-meloland-270"),
        levels=[2.0, 4.0],
        measure="pga",
        unit_blocks=512,
    )
    made.run()
    running = start_listening(Explorer(), {"view": "map"}, StudyView(folder))
    running.run_in_background()
    page = opened(server=running)
    complete(page)
    assert "Study museum" in page.text("#study-tools")
    assert "overturns" in page.text("#map-legend")
    # Another slice, and back: the choice is that of the slice that is drawn.
    scale = page.page.locator("#study-tools label", has_text="scale").locator("select")
    shares = page.text("#map-legend")
    scale.select_option("1")
    page.until("location.search.includes('scale_index=1')")
    assert page.text("#map-legend") != shares
    page.page.go_back()
    page.until("!location.search.includes('scale_index')")
    page.says("map-legend", shares)
    assert scale.input_value() == "0"
    # A rectangle of its cells is shown larger, and left again.
    ends = f"({MODELS}).filter((each) => each.type === 'Figure').map((each) => [each.x_range.start, each.x_range.end])"
    (whole,) = page.js(ends)
    box = page.page.locator("#map").bounding_box()
    x, y = box["x"] + 0.4 * box["width"], box["y"] + 0.3 * box["height"]
    page.page.mouse.move(x, y)
    page.page.mouse.down()
    page.page.mouse.move(x + 150, y + 120, steps=4)
    page.page.mouse.up()
    page.until("!document.getElementById('map-out').disabled")
    ((low, high),) = page.js(ends)
    assert whole[0] < low < high < whole[1]
    page.page.click("#map-out")
    assert page.js(ends) == [whole] and page.page.locator("#map-out").is_disabled()
    page.rested(lambda: page.page.click("#map-open"))
    texts = query_of(page)
    response = rocking.simulate(
        rocking.Block.from_parameters(float(texts["p"]), float(texts["alpha"]), 0.9),
        rocking.records.load("el-centro-meloland-270").scaled(float(texts["scale"])),
    )
    assert ("overturns" in page.text("#verdict")) == response.overturned
    running.server.should_exit = True


def test_uneven_cells_of_a_study_lie_where_their_values_do(opened, tmp_path_factory):
    """Each cell goes to the middle between its value and the next, as it does in the figures of the package."""
    folder = tmp_path_factory.mktemp("study") / "uneven"
    blocks = rocking.Blocks.grid(p=[1.0, 2.0, 4.0, 8.0, 16.0], alpha=[0.2], restitution=[0.9])
    levels = np.array([0.8, 0.2, 0.4]) * 9.80665
    made = rocking.create_study(folder, blocks, rocking.pulses.one_sine(1.0, 1.0), levels=levels, measure="pga")
    made.run()
    falls = made.results().overturned.transpose("scale", "motion", "block").values[[1, 2, 0], 0]
    running = start_listening(Explorer(), {"view": "map"}, StudyView(folder))
    running.run_in_background()
    page = opened("view=map&x=p&y=scale&quantity=overturned", server=running)
    complete(page)
    box = page.page.locator("#map").bounding_box()
    picture = np.asarray(Image.open(io.BytesIO(page.page.locator("#map").screenshot())).convert("RGB"), dtype=int)
    pixels = "const {frame} = Bokeh.index.find_one(" + f"{MODELS}.find((each) => each.type === 'Figure'))"
    inks = np.array([[0xC9, 0xDC, 0xF0], [0xD4, 0x66, 0x0F]])
    right, up = compute_cell_edges(blocks.p[:, 0]), compute_cell_edges(np.sort(levels) / 9.80665)
    judged = 0
    for row, column, part in itertools.product(range(3), range(5), (0.1, 0.9)):
        x, y = right[column] + part * np.diff(right)[column], up[row] + part * np.diff(up)[row]
        across, down = page.js(
            f"(() => {{ {pixels}; return [frame.x_scale.compute({x}), frame.y_scale.compute({y})]; }})()"
        )
        ink = picture[round(down), round(across)]
        assert np.argmin(np.abs(inks - ink).sum(axis=1)) == falls[row, column], (x, y)
        page.page.mouse.move(box["x"] + across, box["y"] + down)
        page.says("map-at", f"{blocks.p[column, 0]:g} rad/s")
        assert f"{np.sort(levels)[row] / 9.80665:.3g} g" in page.text("#map-at")
        judged += 1
    assert judged == 30 and 3 <= falls.sum() <= 12
    running.server.should_exit = True


def test_the_way_back_shows_the_number_that_was_there_before_also_where_the_keys_are(opened):
    page = opened(f"view=map&{SINE}&points=8&x=omega&x_to=4")
    shown = "document.getElementById('map-x-to').value"
    page.until(f"document.body.dataset.map === 'complete' && {shown} === '4'")
    entered(page, "map-x-to", "5")
    page.until(f"{AT}('x_to') === '5'")
    page.page.go_back()
    page.until(f"{AT}('x_to') === '4' && {shown} === '4'", timeout=10.0)


# Periodic motion

CASCADE = "width=0.24&height=1.1&restitution=0.5&motion=sine:amplitude%3D0.8g,frequency%3D2,cycles%3D5"


def periodic(opened, query, **options):
    """Open the view with a sweep of few values, and wait for it."""
    page = opened(f"view=periodic&{query}", **options)
    page.until("document.body.dataset.sweep === 'complete'", "the diagram is complete")
    return page


def settles(page, act):
    """Do something, and wait until the phase plane is that of another case."""
    before = page.js("Number(document.body.dataset.settled ?? 0)")
    act()
    page.until(f"Number(document.body.dataset.settled ?? 0) > {before}", "the phase plane is drawn again")
    return query_of(page)


def test_a_click_on_a_diagram_opens_the_case_at_that_amplitude(opened):
    page = periodic(opened, f"{CASCADE}&sweep_from=2&sweep_to=7.1&sweep_points=100")
    assert page.text("#orbit-verdict") == "It overturns in period 5."
    box = page.page.locator("#diagram").bounding_box()
    # The upper one of the two branches near the right end: the sweep upwards has followed its period doubled.
    place = (box["x"] + 0.935 * box["width"], box["y"] + 0.64 * box["height"])
    page.page.mouse.move(*place)
    page.until(
        "/swept upwards: period 2; swept downwards: overturns/.test(document.getElementById('sweep-at').textContent)"
    )
    found = settles(page, lambda: page.page.mouse.click(*place))
    assert page.text("#orbit-verdict") == "It repeats every 2 periods, with 4 impacts in each repetition."
    assert page.js("document.body.dataset.sweep") == "complete"
    numbers = dict(part.split("=") for part in found["motion"].split(":")[1].split(","))
    block = rocking.Block(width=0.24, height=1.1, restitution=0.5)
    a = float(numbers["amplitude"]) / (9.80665 * math.tan(block.alpha))
    assert 6.7 < a < 7.1
    start = (float(found["initial_rotation"]), float(found["initial_velocity"]))
    rock = rocking.dynamics.stroboscopic_map(block, rocking.pulses.sine(float(numbers["amplitude"]), 2.0, cycles=1))
    assert rock(start, 2) == pytest.approx(start, abs=1e-6)
    page.page.click("[data-view=response]")
    page.until("document.getElementById('python-title').textContent === 'This case as Python'")
    assert query_of(page)["initial_rotation"] == found["initial_rotation"]


@MORE
def test_a_diagram_is_read_by_keys_and_swept_over_the_frequency(opened):
    page = periodic(opened, f"{CASCADE}&sweep_points=100&sweep_from=1&sweep_to=3")
    diagram = page.page.locator("#diagram")
    diagram.focus()
    before = page.text("#sweep-at")
    page.page.keyboard.press("Shift+ArrowLeft")
    page.page.keyboard.press("ArrowLeft")
    page.page.keyboard.press("ArrowUp")
    assert page.text("#sweep-at") != before
    found = settles(page, lambda: page.page.keyboard.press("Enter"))
    assert "initial_rotation" in found
    page.js("document.body.dataset.sweep = 'waits'")
    page.page.select_option("#sweep", "omega")
    page.until("document.body.dataset.sweep === 'complete'")
    found = query_of(page)
    assert found["sweep"] == "omega" and "sweep_from" not in found
    assert page.text("#sweep-at").startswith("Frequency of the pulse")
    assert "case, np.linspace(0.5, 8.0, 100), (0.0, 0.0)" in page.text("#python")


@MORE
def test_a_diagram_is_taken_away_and_computed_again(opened, tmp_path):
    page = periodic(opened, f"{CASCADE}&sweep_points=100&sweep_from=1&sweep_to=7.2")
    assert page.text("#python-title") == "This diagram as Python"
    saved = {}
    for name, label in (("svg", "Figure, SVG"), ("png", "Figure, PNG"), ("csv", "Numbers, CSV")):
        with page.page.expect_download() as download:
            page.page.get_by_role("button", name=label).click()
        assert download.value.suggested_filename == f"rocking-diagram.{name}"
        saved[name] = Path(download.value.path()).read_bytes()
    assert saved["png"].startswith(b"\x89PNG") and b"<svg" in saved["svg"][:200]
    rows = [line.split(",") for line in saved["csv"].decode().splitlines()]
    assert rows[0] == ["a", "sweep", "rotation_rad", "velocity_rad_per_s"]
    script = tmp_path / "diagram.py"
    script.write_text(page.text("#python"), "utf-8")
    ran = runpy.run_path(str(script))["found"]
    judged = 0
    for a, direction, rotation, velocity in rows[1:]:
        at = ran.data.sel(direction=direction, value=float(a), start=0)
        states = np.stack([at.coordinate.values, at.velocity.values], axis=-1)
        if rotation:
            assert [float(rotation), float(velocity)] in states.tolist()
        else:
            assert np.isnan(states[-1]).all()
        judged += 1
    assert judged >= 200 and {*ran.data.direction.values} == {row[1] for row in rows[1:]} == {"up", "down"}


def test_a_record_is_answered_with_the_nearest_sine(opened):
    page = opened(f"view=periodic&{STATUE}&sweep_points=24")
    page.says("orbit-verdict", "needs a sine")
    assert not page.page.locator("#orbit").is_visible() and not page.page.locator("#save").is_visible()
    page.page.click("#orbit-sine")
    page.until("(new URLSearchParams(location.search).get('motion') ?? '').startsWith('sine:')", "the case is a sine")
    found = query_of(page)
    assert "pga" not in found and found["width"] == "0.24"
    page.until("document.body.dataset.sweep === 'complete'")
    assert page.page.locator("#save").is_visible()


def amplitude_in_code(page):
    """Amplitude over the threshold of uplift with which the script of a diagram computes the case itself."""
    return float(re.search(r"stroboscopic_map\(\*case\(([\d.]+)\)", page.text("#python"))[1])


def test_the_code_and_the_mark_of_a_diagram_are_of_the_case_that_is_shown(opened):
    page = periodic(opened, f"{CASCADE},phase%3D0deg&sweep_points=8&sweep_from=1&sweep_to=3")
    swept = []
    page.page.on("request", lambda request: swept.append(request.url) if "/api/sweep?" in request.url else None)
    settles(page, lambda: entered(page, "pulse-amplitude", "0.5"))
    assert amplitude_in_code(page) == pytest.approx(0.5 * 1.1 / 0.24, rel=1e-12)
    settles(page, lambda: entered(page, "pulse-cycles", "9"))
    page.page.focus("#diagram")
    page.page.keyboard.press("ArrowLeft")
    found = settles(page, lambda: page.page.keyboard.press("Enter"))
    assert "cycles=9" in found["motion"]
    start = tuple(float(found[f"initial_{name}"]) for name in ("rotation", "velocity"))
    assert f"rock.orbit({start!r}, " in page.text("#python")
    assert swept == []  # the diagram is the same all the while


# Comparing


def test_a_thresholds_wrong_answer_is_seen(opened):
    page = opened(f"view=compare&{STATUE}")
    page.until("document.body.dataset.compared")
    first, second = plotted(page, "first", "compare-plots"), plotted(page, "second", "compare-plots")
    assert max(first["y"]) > 2.0 * max(second["y"])
    assert "7 by the treatment" in page.text("#compare-verdict")
    assert page.text("#compare-verdict").startswith("The other (Velocity threshold, 0.05 pα): It stays up")


@pytest.mark.parametrize("what", ["block", "motion"])
def test_two_blocks_or_two_motions_are_compared(opened, what):
    page = opened(f"view=compare&{STATUE}")
    page.page.select_option("#compare-with", what)
    page.until("[...new URLSearchParams(location.search).keys()].some((name) => name.startsWith('other.'))")
    other = {name[6:]: value for name, value in query_of(page).items() if name.startswith("other.")}
    block = rocking.Block(width=float(other.get("width", 0.24)), height=float(other.get("height", 1.1)))
    motion = rocking.records.load(other.get("motion", "ridgecrest-clc-090")).scaled_to(0.4 * 9.80665)
    response = rocking.simulate(block, motion)
    rests = int(np.sum(response.events["kind"] == "rest"))
    words = (
        "overturns"
        if response.overturned
        else {0: "does not come to rest", 1: "once", 2: "twice"}.get(rests, f"{rests} times")
    )
    page.says("compare-verdict", words)


@pytest.mark.parametrize(
    ("query", "size"),
    [
        ("length_in=cm&width=0.24&height=1.1", {"width": "0.36", "height": "1.65"}),
        ("length_in=in&width=10in&height=40in", {"width": "15in", "height": "60in"}),
        ("p=2&alpha=12deg", {"p": "1.6", "alpha": "12deg"}),
    ],
)
def test_the_other_block_is_half_as_large_again_whatever_lengths_are_shown_in(opened, query, size):
    page = opened(f"view=compare&compare=block&motion=one-sine:amplitude%3D4,frequency%3D1&{query}")
    page.until("[...new URLSearchParams(location.search).keys()].some((name) => name.startsWith('other.'))")
    found = query_of(page)
    assert {name: found[f"other.{name}"] for name in size} == size


def test_the_other_block_stays_when_it_is_described_otherwise_whatever_the_gravity(opened):
    query = STATUE.replace("0.4g", "0.1g")
    page = opened(f"{query}&gravity=1.62&view=compare&compare=block&other.width=0.36&other.height=1.65")
    page.until("document.body.dataset.compared")
    for shape, name in (("pivots", "gyration"), ("parameters", "p"), ("sizes", "width")):
        page.page.select_option("#other-shape", shape)
        page.until(f"new URLSearchParams(location.search).has('other.{name}')")
    found = query_of(page)
    assert [float(found[f"other.{name}"]) for name in ("width", "height")] == pytest.approx([0.36, 1.65], rel=1e-9)


# Records, assessment, units, paper


def dropped(page, files):
    """Drop files on the page at once: texts by their names."""
    page.js(
        """(files) => {
            const carried = new DataTransfer();
            for (const [name, text] of Object.entries(files)) carried.items.add(new File([text], name));
            window.dispatchEvent(new DragEvent("drop", {dataTransfer: carried, cancelable: true}));
        }""",
        files,
    )
    page.until("document.body.dataset.added", "all files are in the list")


def test_many_files_are_dropped_asked_about_once_sorted_searched_and_shake_the_block(opened, explorer):
    emptied(explorer)
    page = opened("width=0.24&height=1.1&motion=ridgecrest-clc-090")
    level = np.random.default_rng(5).normal(size=600)
    names = [f"station{k}_{part}.txt" for k in (1, 2) for part in ("ns", "ew", "up")]
    dropped(page, {name: "\n".join(map(str, (k + 1) * 0.05 * level)) for k, name in enumerate(names)})
    assert query_of(page)["view"] == "records" and page.text("#records-said") == "6 of 6 files were read."
    asked = page.text("#records-missing")
    assert asked.count("6 files of one drop do not say") == 2 and "PGA" in asked
    assert page.page.locator("tr.station").count() == 5
    assert page.page.locator("[data-record]:disabled").count() == 6
    for button in ("all g", "all 0.01 s"):
        page.page.locator("#records-missing button", has_text=re.compile(f"^{button}$")).click()
        page.until(f"!document.getElementById('records-missing').textContent.includes('{button}')")
    assert not page.page.is_visible("#records-missing")
    page.page.fill("#records-search", "station2")
    assert page.page.locator("[data-record]").all_text_contents() == names[3:]
    page.page.locator(".sorting", has_text="PGA").click()
    assert page.page.locator("[data-record]").all_text_contents() == [names[4], names[3], names[5]]
    assert page.page.get_attribute("#records-table th[aria-sort]", "aria-sort") == "descending"
    page.page.check("#records-vertical")
    page.rested(lambda: page.page.click(f"[data-record]:text-is('{names[4]}')"))
    query = query_of(page)
    assert query["motion"].startswith("file:") and query["vertical"].startswith("file:")
    assert (query["units"], query["dt"]) == ("g", "0.01") and query["vertical"] != query["motion"]
    assert page.page.get_attribute("[data-record][aria-current]", "data-record") == f"{query['motion']}#"
    page.page.fill("#records-search", "china lake 360")
    page.rested(lambda: page.page.click("[data-record]"))
    assert query_of(page)["motion"] == "ridgecrest-clc-360"
    page.page.fill("#records-search", "station")
    for left in (1, 0):
        page.page.locator("tr.station button").first.click()
        page.until(f"document.querySelectorAll('tr.station').length === {left}")


ROWS = "time (s),a (g)\n" + "".join(f"{0.01 * k:.2f},{0.3 * (-1) ** (k // 20)}\n" for k in range(100))
LISTED = "Number(document.body.dataset.listed ?? 0) > 0 && document.querySelectorAll('[data-record]').length"


def emptied(explorer):
    """Forget the files of other tests."""
    for key in explorer.uploads.list_records():
        explorer.uploads.remove(key)


def test_what_is_ticked_is_what_the_address_says_and_what_is_assessed(opened, explorer):
    emptied(explorer)
    page = opened(f"{STATUE}&view=records&levels=3", allowed=["422"])
    page.until(LISTED)
    boxes = page.page.locator("#records-table tbody input[type=checkbox]")
    ticked = "Array.from(document.querySelectorAll('#records-table input'), (each) => each.checked)"
    before = page.js(ticked)
    boxes.nth(0).set_checked(not before[0])
    assert query_of(page)["records"]
    page.page.go_back()
    page.until("!new URLSearchParams(location.search).has('records')")
    page.until(f"JSON.stringify({ticked}) === {json.dumps(json.dumps(before).replace(' ', ''))}")
    for k in range(boxes.count()):
        boxes.nth(k).uncheck()
    page.paused(250)
    page.page.reload()
    page.until(f"document.body?.dataset.ready && {LISTED}")
    assert True not in page.js(ticked)
    page.page.click("#records-assess")
    page.until("!document.getElementById('problem').hidden")
    assert page.text("#problem").endswith("tick one or more in the list")


def test_a_file_that_is_taken_out_is_no_longer_assessed(opened, explorer):
    emptied(explorer)
    page = opened(f"{STATUE}&levels=2")
    dropped(page, {"a.csv": ROWS, "b.csv": f"{ROWS}1.00,0.2\n"})
    boxes = page.page.locator("#records-table tbody input[type=checkbox]")
    names = page.page.locator("#records-table [data-record]").all_text_contents()
    for k, name in enumerate(names):
        boxes.nth(k).set_checked(name in ("a.csv", "b.csv"))
    assert query_of(page)["records"].count("file") == 2
    page.page.locator("tr.station button").first.click()
    page.until(f"{LISTED} === {len(names) - 1}")
    assert query_of(page)["records"].count("file") == 1
    page.page.click("#records-assess")
    page.until("document.body.dataset.assessment === 'complete'")
    assert page.text("#assessment-about").startswith("1 record of the list")


def test_an_assessment_is_the_packages_fragility_and_stops_when_the_reader_goes(opened):
    names = ("el-centro-meloland-270", "el-centro-meloland-360", "ridgecrest-clc-360", "ridgecrest-tow2-360")
    records = ";".join(f"motion={name}" for name in names)
    query = {"view": "assessment", "records": records, "levels": "6", "level_from": "0.2g", "level_to": "0.9g"}
    page = opened(f"{STATUE}&{urlencode({**query, 'friction': '0.2'})}")
    page.until("document.body.dataset.assessment === 'complete'", "the assessment is complete")
    block, motions = rocking.Block(width=0.24, height=1.1), [rocking.records.load(name) for name in names]
    stripes = {"levels": np.linspace(0.2, 0.9, 6) * 9.80665, "polarity": "both", "clusters": "station"}
    curve = rocking.fragility(block, motions, **stripes).curves[0]
    low = f"{curve.median_interval[0] / 9.80665:.3g} g"
    said = f"at {curve.median / 9.80665:.3g} g (with 90 % confidence {low} to ∞)"
    assert said in page.text("#assessment-verdict")
    assert "The records are of 3 stations" in page.text("#assessment-about")
    assert page.page.locator("#assessment-records tbody tr").count() == 4
    assert "slides before it rocks" in page.text("#assessment-figures")
    first = rocking.incremental_dynamic_analysis(block, rocking.records.load("ridgecrest-clc-090"))
    level = f"{float(first.data.overturning_level.values[0, 0]) / 9.80665:.3g} g"
    assert f"overturns first at {level}" in page.text("#assessment-figures")
    assert "as it is" not in page.text("#assessment-figures").partition("overturns first at")[2]
    assert "the lowest level that overturns, looked for in steps of 5 %" in page.text("#assessment-about")
    assert "may overturn under 4 of 4" in page.text("#assessment-rules")
    assert "rocking.fragility(block" in page.text("#python")
    assert query_of(page)["records"] == records
    page.page.fill("#levels", "60")
    page.page.press("#levels", "Enter")
    page.until("document.body.dataset.assessment === 'running'")
    done = page.js("document.body.dataset.assessed")
    page.page.click("[data-view=response]")
    page.paused(500)
    assert page.js("document.body.dataset.assessed") == done and not page.page.is_visible("#problem")


def test_units_are_chosen_once_and_in_the_address(opened):
    page = opened(f"{STATUE}&length_in=cm&angle_in=rad&acceleration_in=m/s2")
    assert page.page.input_value("#width") == "24" and page.page.input_value("#pga") == "3.923"
    assert "α = 0.215 rad" in page.text("#derived") and "lifts above 2.14 m/s²" in page.text("#derived")
    assert "0.0569 rad at" in page.text("#figures") and peak_shown(page) == pytest.approx(0.265, abs=1e-3)
    page.rested(lambda: (page.page.fill("#width", "25"), page.page.press("#width", "Enter")))
    query = query_of(page)
    assert (query["width"], query["length_in"], query["acceleration_in"]) == ("25cm", "cm", "m/s2")
    with page.page.expect_event("load"):
        page.page.select_option("#length_in", "in")
    page.until("document.body.dataset.rested", "the page is there again")
    assert page.page.input_value("#width") == "9.843" and query_of(page)["length_in"] == "in"


def test_every_sentence_and_axis_has_the_units_that_are_chosen(opened):
    units = "&length_in=cm&angle_in=rad&acceleration_in=m/s2"
    axes = f"{MODELS}.filter((each) => each.type === 'LinearAxis').map((each) => each.axis_label)"
    ends = f"{MODELS}.filter((each) => each.type === 'Range1d').map((each) => each.end)"
    for more, rotation, ground, axis, peak in (
        ("", "rotation 3.26° =", "ground 0.0666 g", "ground (g)", 0.44),
        (units, "rotation 0.0569 rad =", "ground 0.653 m/s²", "ground (m/s²)", 0.44 * 9.80665),
    ):
        page = opened(f"{STATUE}&at=232.68{more}")
        page.until("document.getElementById('cursor').dataset.time")
        assert rotation in page.text("#cursor") and ground in page.text("#cursor"), page.text("#cursor")
        assert axis in page.js(axes) and any(each == pytest.approx(peak) for each in page.js(ends))
    still = "width=0.24&height=1.1&motion=rectangular:amplitude%3D0.1g,duration%3D0.5"
    for more, lifting in (("", "0.218 g"), (units, "2.14 m/s²")):
        assert f"never passes {lifting}, which" in opened(still + more).text("#verdict")
    released = f"view=periodic&{CASCADE}&initial_rotation=0.0174532925&sweep_points=24"
    for more, start in (("", "from 1° and 0 rad/s"), (units, "from 0.01745 rad and 0 rad/s")):
        page = opened(released + more)
        page.says("orbit-about", start)


@pytest.mark.parametrize("scheme", [pytest.param("light", marks=MORE), "dark"])
def test_a_plain_case_is_printed_on_one_light_page_without_controls(opened, scheme):
    page = opened(STATUE, scheme=scheme)
    page.js("window.print = () => { document.body.dataset.printed = '1'; }; 1")
    page.page.click("#print")
    page.until("document.body.dataset.printed", "the page is ready to be printed")
    figure = f"{MODELS}.find((each) => each.type === 'Figure').background_fill_color"
    assert page.js(figure) == "#ffffff"
    paper = page.page.pdf(prefer_css_page_size=True)
    assert len(re.findall(rb"/Type\s*/Page\b", paper)) == 1
    page.page.emulate_media(media="print")
    controls = page.page.query_selector_all("button, select, input")
    assert len(controls) > 50 and not any(each.is_visible() for each in controls)
    head = page.text("#print-head")
    for part in ("0.24 m x 1.1 m", "ridgecrest-clc-090", "nonlinear", "by: Proof", rocking.__version__, "pga=0.4g"):
        assert part in head
    assert "stands in 5 of 5 motions" in page.text("#print-summary")
    page.page.emulate_media(media="screen")
    page.js("window.dispatchEvent(new Event('afterprint'))")
    assert (page.js(figure) == "#ffffff") == (scheme == "light")


# People


def barriers(page, where="document"):
    """What axe finds on the page as it is, or in parts of it, with the sizes of targets (WCAG 2.2, AA)."""
    options = "{resultTypes: ['violations'], rules: {'target-size': {enabled: true}}}"
    found = page.js(f"axe.run({where}, {options})")
    return [(each["id"], [node["target"] for node in each["nodes"]][:4]) for each in found["violations"]]


#: What is said on the page: code, and numbers as Python prints them, are left out.
SAID = """Array.from(document.querySelectorAll('main > section:not(#save), .settings'),
  (each) => each.innerText.replace(document.getElementById('words').innerText, '')).join(' ')"""

#: What holds when a view has computed all that it shows.
COMPUTED = {
    "map": "document.body.dataset.map === 'complete'",
    "periodic": "document.body.dataset.sweep === 'complete'",
    "compare": "document.body.dataset.compared",
    "assessment": "document.body.dataset.assessment === 'complete'",
    "records": "document.querySelectorAll('[data-record]').length > 5",
}


@pytest.mark.parametrize(
    ("viewport", "scheme"), [(DESK, "light"), pytest.param(PHONE, "dark", marks=MORE)], ids=["desk", "phone"]
)
def test_no_view_has_a_barrier(opened, viewport, scheme):
    axe = tool("axe-core/axe.min.js").read_text("utf-8")
    # The checker itself writes styles that the page's policy does not admit.
    query = f"{SINE}&points=24&sweep_points=24&levels=6&records={RECORDS}"
    page = opened(query, viewport, scheme, bypass_csp=True, allowed=["422"])
    page.js(axe + "; 1")
    judged = []
    views = VIEWS if viewport is DESK else VIEWS[:3]
    for view in (*views, "records", "assessment"):
        page.page.click(f"[data-view={view}]")
        page.until(COMPUTED.get(view, "true"))
        page.paused(300)
        assert barriers(page) == [], view
        assert page.js("document.documentElement.scrollWidth") <= viewport["width"], view
        # One way of writing numbers: 5·10⁻¹⁰, on the page as at the axes.
        assert re.findall(r"\b\d[\d.]*e[-−+]?\d+", page.js(SAID)) == [], view
        judged.append(view)
    page.page.click("[data-view=block]")
    page.page.click("#lecture")
    page.until("document.body.classList.contains('lecture')")
    assert barriers(page) == [], "lecture"
    page.page.keyboard.press("f")
    if viewport is PHONE:
        page.page.click("#to-settings")
        assert barriers(page) == [], "settings over the picture"
    for part in ("#settings", "main"):
        for button in page.page.locator(f"{part} button.what:visible").all():
            button.click()
        if viewport is PHONE:
            page.page.click("#to-settings")  # closed, and opened again
    assert barriers(page) == [], "explanations"
    page.page.fill("#p", "-1")
    page.page.press("#p", "Enter")
    page.until("document.getElementById('main').classList.contains('old')")
    for view in views[:2]:
        page.page.click(f"[data-view={view}]")
        assert page.page.title().startswith(f"{view.capitalize()}:")
        page.js("scrollTo(0, 0)")  # what the head covers elsewhere is no barrier
        assert barriers(page) == [], f"{view}, dimmed"
        judged.append(view)
    page.page.click("#to-examples")
    page.until("document.querySelectorAll('#examples-list button').length > 5")
    assert barriers(page) == [], "examples"
    page.page.click("#examples-list button")
    page.until("!document.getElementById('example').hidden")
    assert barriers(page) == [], "a step of an example"
    assert len(judged) == len(views) + 4


def test_a_finger_scrolls_the_page_over_the_plots(opened):
    page = opened(STATUE, PHONE, has_touch=True, is_mobile=True)
    assert page.js(f"{MODELS}.filter((each) => each.type === 'BoxZoomTool').length") == 0
    assert page.page.locator(".drag").is_hidden() and page.text("#cursor") == "Tap the plots to read them."


FOCUSED = "document.activeElement.id"


def test_every_control_shows_its_focus_and_is_large_enough(opened):
    page = opened(f"view=block&{STATUE}")
    seen, faint, small = set(), set(), set()
    for _ in range(60):
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
        if outline < 2:
            faint.add(name)
        if min(size) < 24:
            small.add(name)
    assert len(seen) > 35
    assert faint == set() and small == set()


@pytest.mark.parametrize("width", [pytest.param(390, marks=MORE), 320])
def test_a_phone_shows_the_picture_while_settings_are_changed(opened, width):
    page = opened(STATUE, {"width": width, "height": 700}, allowed=["422"])
    tabs = {page.js(f"document.querySelector('[data-view={view}]').getBoundingClientRect().right") for view in VIEWS}
    assert max(tabs) <= width
    assert page.page.locator("#width").is_hidden()
    page.page.click("#to-settings")
    top, bottom = (
        page.js(f"document.getElementById('histories').getBoundingClientRect().{end}") for end in ("top", "bottom")
    )
    sheet = page.page.locator("#settings").bounding_box()
    assert 0 <= top < sheet["y"] - 150 and bottom > top + 300
    assert sheet["y"] + sheet["height"] <= 700
    page.page.fill("#width", "-1")
    page.page.press("#width", "Enter")
    page.until("document.querySelector('.number[data-problem]')")
    field = page.js("document.querySelector('.number[data-problem]').getBoundingClientRect().toJSON()")
    assert sheet["y"] <= field["top"] and field["bottom"] <= sheet["y"] + sheet["height"]
    assert page.js("document.documentElement.scrollWidth") <= width
    page.page.keyboard.press("Escape")
    assert page.page.locator("#width").is_hidden() and page.js(FOCUSED) == "to-settings"
    page.page.click("[data-view=block]")
    page.until("document.getElementById('stage').checkVisibility()")
    page.page.click("#to-settings")
    stage = page.page.locator("#stage").bounding_box()
    assert stage["y"] + stage["height"] <= sheet["y"], "all of the block is seen"


def test_a_lecture_shows_the_stage_large_and_says_how_much_larger_the_rotation_is(opened):
    page = opened(f"{STATUE}&lecture=1", {"width": 1280, "height": 800})
    stage = page.page.locator("#stage").bounding_box()
    plots = page.page.locator("#histories").bounding_box()
    assert stage["height"] == pytest.approx(0.6 * 800, abs=1.0)
    assert plots["x"] >= stage["x"] + stage["width"]
    assert page.page.locator("#settings").is_hidden()
    peak = statue(0.4 * 9.80665).peak_over_slenderness
    assert 3 * peak <= 1 < 5 * peak
    assert page.text("#magnify option:checked") == "by its peak, 3 × larger"
    assert "drawn 3 times larger" in page.text("#stage-about")
    assert query_of(page)["lecture"] == "1"
    page.page.keyboard.press("f")
    assert page.page.locator("#settings").is_visible() and "lecture" not in query_of(page)
    assert page.page.locator("#magnify").input_value() == "1"
    page.page.keyboard.press("f")
    page.until("document.fullscreenElement")
    page.page.keyboard.press("f")
    page.until("!document.fullscreenElement")


@MORE
def test_impacts_click_louder_the_faster_they_are_and_a_video_is_recorded(opened):
    page = opened(f"view=block&{STATUE}&from=232&to=239.7")
    page.js(
        """() => {
          window.heard = [];
          const sounds = AudioContext.prototype, source = AudioBufferSourceNode.prototype;
          const make = sounds.createGain, start = source.start;
          sounds.createGain = function () { window.gain = make.call(this); return window.gain; };
          source.start = function (time) {
            const clock = document.getElementById('clock').textContent.split(' ')[0];
            window.heard.push([Number(clock), window.gain.gain.value]);
            start.call(this, time);
          };
        }"""
    )
    play, clock = page.page.locator("#play"), "Number(document.getElementById('clock').textContent.split(' ')[0])"

    def scrub(value):
        page.js(
            """(value) => {
              const scrub = document.getElementById('scrub');
              scrub.value = value;
              scrub.dispatchEvent(new Event('input'));
            }""",
            value,
        )

    page.page.uncheck("#slow")
    scrub(8000)
    play.click()
    page.until(f"{clock} > 238.4")
    play.click()
    assert page.js("window.heard.length") == 0  # off by default
    page.page.check("#sound")
    page.page.select_option("#speed", "0.1")
    scrub(9000)
    start = page.js(clock)
    play.click()
    page.until("window.heard.length >= 5")
    play.click()
    heard = np.array(page.js("window.heard"))
    impacts = statue(0.4 * 9.80665).impacts
    after = impacts[impacts["time"] > start][: len(heard)]
    # Each click comes in the picture that first shows its impact; loudness rises with the speed as a line.
    assert heard[:, 0] == pytest.approx(after["time"], abs=0.1)
    fastest = impacts["speed_after"].max()
    assert heard[:, 1] == pytest.approx(0.06 + 0.94 * after["speed_after"] / fastest, rel=1e-4)
    page.page.select_option("#speed", "2")
    with page.page.expect_download() as saved:
        page.page.click("#record")
        page.until("document.getElementById('record-progress').value > 0.15")
        page.page.click("#record")
    assert Path(saved.value.path()).read_bytes()[:4] == bytes.fromhex("1a45dfa3")


def test_ticks_are_written_as_numbers_are(opened):
    page = opened(STATUE)
    for values, texts in (
        ([0.001, 0.002, 0.003], ["0.001", "0.002", "0.003"]),
        ([-0.2, 0, 0.2], ["−0.2", "0", "0.2"]),
        ([0, 2e-7, 4e-7], ["0", "2·10⁻⁷", "4·10⁻⁷"]),
    ):
        assert page.js(f"import('/page/ticks.js').then(({{written}}) => written({values}))") == texts


# A notebook


@contextmanager
def notebook(html, asked=None):
    """Serve a page that shows a frame, as a notebook does, on a port of its own; keep what it was asked for."""

    class Handler(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            if asked is not None:
                asked.append(f"{self.requestline} {self.headers}")
            self.send_response(200)
            self.send_header("content-type", "text/html; charset=utf-8")
            self.end_headers()
            if self.path == "/":
                self.wfile.write(f"<!doctype html><title>notebook</title><body><div>{html}</div></body>".encode())

        def log_message(self, *_):
            pass

    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield server.server_address[1]
        server.shutdown()


@pytest.mark.parametrize("host", [pytest.param("127.0.0.1", marks=MORE), "localhost"])
def test_a_response_is_explored_in_a_notebooks_frame(browser, host):
    block = rocking.Block.from_pivots((0.2, 0.15), 0.6, 0.4)
    response = rocking.simulate(block, rocking.pulses.one_sine(4.0, 1.0) + rocking.pulses.one_sine(1.0, 3.0))
    frame = rocking.explore(response)
    with notebook(frame._repr_html_()) as port:
        context = browser.new_context(viewport=DESK)
        page = context.new_page()
        page.goto(f"http://{host}:{port}/")
        inside = page.frame_locator("iframe")
        inside.locator("#figures dd").first.wait_for(timeout=60_000)
        shown = inside.locator("#figures dd").first.text_content()
        context.close()
    assert shown.startswith("overturns") == response.overturned
    if not response.overturned:
        assert as_number(shown.split(" ")[0]) == pytest.approx(response.peak_over_slenderness, rel=2e-3)


def test_a_foreign_page_cannot_show_the_explorer_in_a_frame(browser, here, opened):
    page = opened(STATUE)
    context = page.page.context
    with notebook(f'<iframe src="http://127.0.0.1:{here.port}/"></iframe>') as port:
        other = context.new_page()
        other.goto(f"http://127.0.0.1:{port}/")
        other.wait_for_timeout(500)
        assert other.frames[1].evaluate("document.body?.textContent.includes('Ground motion') ?? false") is False


# The secret


def test_a_reload_another_tab_and_the_way_back_know_the_secret_and_no_other_port_is_told(browser, here):
    context = browser.new_context(viewport=DESK)
    first = Watched(context.new_page(), allowed=["CORS", "Failed to load", "403"])
    first.page.goto(here.link({"width": "0.3", "height": "1.2"}))
    first.until(READY)
    address, secret = first.page.url, first.js("localStorage.getItem('rocking-secret')")
    assert len(secret) > 40 and "#" not in address and "token" not in address and secret not in address
    first.page.reload()
    first.until(READY)
    second = Watched(context.new_page())
    second.page.goto(address)  # typed, or from a bookmark
    second.until(READY)
    with context.expect_page() as opening:
        second.js("void window.open(location.href)")
    third = Watched(opening.value)
    third.until(READY)
    asked = []
    with notebook("", asked) as port:
        first.page.goto(f"http://127.0.0.1:{port}/")
        there = [f"http://127.0.0.1:{here.port}{path}" for path in ("/api/start", "/", "/page/main.js")]
        for mode in ("cors", "no-cors"):
            read = "fetch(u, {mode: m, credentials: 'include'}).then((r) => r.text(), () => '')"
            assert first.js(f"([us, m]) => Promise.all(us.map((u) => {read}))", [there, mode]) == ["", "", ""]
        assert first.js("Object.keys(localStorage)") == []
        first.page.evaluate("location.href = 'about:blank'")
        first.page.wait_for_url("about:blank")
    assert len(asked) >= 1 and not any(secret in each or "ookie" in each for each in asked)
    # In one step: a page that is just coming back cannot be asked to go back.
    with first.page.expect_navigation(url=address):
        first.page.evaluate("void setTimeout(() => history.go(-2))")
    first.until(READY)
    assert context.cookies() == []
    assert second.complaints == third.complaints == []
    context.close()


def test_a_browser_without_the_link_is_told_so(browser, here):
    context = browser.new_context(viewport=DESK)
    page = Watched(context.new_page(), allowed=["403"])
    for fragment in ("", "#token=spent"):
        page.page.goto(f"http://127.0.0.1:{here.port}/?width=0.3&height=1.2{fragment}")
        page.until("!document.getElementById('problem').hidden")
        assert "needs the link that rocking explore printed" in page.text("#problem")
        page.page.goto("about:blank")
    assert page.complaints == []
    context.close()


# Back and forward, pinned cases, curves that were


def test_back_and_forward_go_from_change_to_change_and_show_an_unchanged_map_at_once(opened):
    page = opened(SINE + "&view=map&points=24")
    page.until("document.body.dataset.map === 'complete'")
    took = page.js("document.body.dataset.mapTook")
    page.rested(lambda: page.page.click("#map-open"))
    page.until("new URLSearchParams(location.search).get('view') === null")
    opened_at = query_of(page)
    width = page.page.locator("#restitution")
    page.rested(lambda: (width.fill("0.9"), width.press("Enter")))
    assert query_of(page)["restitution"] == "0.9"
    page.page.go_back()
    page.until("new URLSearchParams(location.search).get('restitution') === '0.92'")
    assert query_of(page) == opened_at and width.input_value() == "0.92"
    page.page.go_back()
    page.until("document.querySelector('[data-view=map]').getAttribute('aria-current')")
    page.paused(100)
    assert page.js("[document.body.dataset.map, document.body.dataset.mapTook]") == ["complete", took]
    assert "a" in page.text("#map-at") and query_of(page)["view"] == "map"
    page.page.go_forward()
    page.until("new URLSearchParams(location.search).get('view') === null")
    page.page.reload()
    page.until("document.body.dataset.ready && document.body.dataset.rested")
    assert query_of(page) == opened_at


def test_a_drag_is_one_entry_of_the_history(opened):
    page = opened(STATUE)
    before = page.js("history.length")
    slider = page.page.locator("#pga-slider")
    box = slider.bounding_box()
    page.page.mouse.move(box["x"] + 0.6 * box["width"], box["y"] + 0.5 * box["height"])
    page.page.mouse.down()
    for k in range(1, 4):
        drawn = page.js("Number(document.body.dataset.drawn)")
        page.page.mouse.move(box["x"] + (0.6 + 0.02 * k) * box["width"], box["y"] + 0.5 * box["height"])
        page.until(f"Number(document.body.dataset.drawn) > {drawn}")
    page.page.mouse.up()
    moved = query_of(page)["pga"]
    assert moved != "0.4g" and page.js("history.length") == before + 1
    page.page.go_back()
    page.until("document.getElementById('pga').value === '0.4'")


@MORE
def test_a_pinned_case_is_returned_to_compared_with_and_kept(opened):
    page = opened(STATUE)
    page.page.click("#pin")
    page.page.fill("#pin-name", "as found")
    page.page.click("#pin")
    width = page.page.locator("#width")
    page.rested(lambda: (width.fill("0.3"), width.press("Enter")))
    page.page.reload()
    page.until("document.body.dataset.ready && document.body.dataset.rested")
    page.page.click("[data-view=compare]")
    page.page.select_option("#compare-with", "case")
    page.until("document.body.dataset.compared")
    page.until("new URLSearchParams(location.search).get('compare') === 'case'")
    found = query_of(page)
    assert (found["width"], found["other.width"], found["other.pga"]) == ("0.3", "0.24", "0.4g")
    page.says("compare-verdict", "The other (as found): ")
    assert page.page.locator("#other-case option").all_text_contents() == ["as found"]
    saved = {}
    for label in ("Both, SVG", "Both, PNG"):
        with page.page.expect_download() as download:
            page.page.click(f"text={label}")
        saved[label] = Path(download.value.path()).read_bytes()
        assert "ridgecrest-clc-090" in download.value.suggested_filename
    assert saved["Both, PNG"].startswith(b"\x89PNG") and b"the other: p = 3.61" in saved["Both, SVG"]
    page.rested(lambda: page.page.click(".chip button"))
    assert query_of(page)["width"] == "0.24"
    page.page.click(".chip .remove")
    assert page.js("localStorage.getItem('rocking-snapshots')") == "[]"


@MORE
def test_a_case_is_pinned_as_it_was_when_its_name_was_asked_for_and_replaces_no_other(opened):
    page = opened(STATUE)
    other = opened(STATUE)
    pins = "JSON.parse(localStorage.getItem('rocking-snapshots') ?? '[]').map(({name, texts}) => [name, texts.pga])"
    page.page.click("#pin")
    name = page.page.input_value("#pin-name")
    assert name == "p = 3.61 rad/s, α = 12.3°, ridgecrest-clc-090 0.4 g"
    page.rested(lambda: entered(page, "pga", "0.5"))
    page.page.click("#pin")
    assert page.js(pins) == [[name, "0.4g"]]
    # Another tab knows, keeps its own beside it, and replaces none.
    other.until("document.querySelectorAll('.chip').length === 1")
    other.rested(lambda: other.page.select_option("#model", "linear"))
    other.page.click("#pin")
    assert other.page.input_value("#pin-name") == f"{name} (2)"
    other.page.click("#pin")
    page.until("document.querySelectorAll('.chip').length === 2")
    page.page.click("#pin")
    page.page.fill("#pin-name", name)
    page.page.click("#pin")
    assert page.js(pins) == [[name, "0.4g"], [f"{name} (2)", "0.4g"], [f"{name} (3)", "0.5g"]]
    for _ in range(3):
        page.page.locator(".chip .remove").first.click()
    assert page.js(pins) == []


# What is chosen while an answer is on its way


@contextmanager
def held(page, pattern):
    """Hold back what the page asks for by addresses like this, and let it go in the end."""
    waiting = []
    page.page.route(pattern, lambda route: waiting.append(route))
    yield waiting
    page.page.unroute(pattern)  # which lets go what waits


def asked(page, waiting, count=1):
    """Wait until so much is held back."""
    for _ in range(400):
        if len(waiting) >= count:
            return
        page.paused(25)
    raise AssertionError(f"{len(waiting)} of {count} were asked for")


def entered(page, name, text):
    """Type something into a field, and commit it."""
    page.page.fill(f"#{name}", text)
    page.page.press(f"#{name}", "Enter")


def acted(page, *acts):
    """Do what is written: `enter FIELD TEXT`, `press SELECTOR KEY`, `choose SELECTOR VALUE`, `click SELECTOR`."""
    for act in acts:
        verb, target, *given = act.split()
        if verb == "enter":
            entered(page, target, *given)
        else:
            {"press": page.page.press, "choose": page.page.select_option, "click": page.page.click}[verb](
                target, *given
            )


AT = "new URLSearchParams(location.search).get"
DRAWN = (
    "(({origin, unit}) => Number(origin) + Number(unit) * Bokeh.documents.map((each) => each.get_model_by_name("
    "'histories-first')).filter(Boolean)[0].data.x[0])(document.getElementById('histories').dataset)"
)
SINE_MAP = f"view=map&{SINE}&points=8&x=omega&x_from=1&x_to=5&y=a&y_from=1&y_to=1.1"
BUTTONS = "document.querySelectorAll('#exports button').length === 6"
IN_CODE = "document.getElementById('python').textContent.includes"

#: What is done while an answer is held back, after what has asked for it, and what holds in the end.
LATE = {
    "keys": (
        f"{STATUE}&from=231&to=235", "window", ["press #histories +"],
        ["press #histories ArrowRight", "press #histories -"], f"{AT}('from') === '231.5'",
    ),
    "keys of a comparison": (
        f"{STATUE}&from=231&to=235&view=compare", "compare", ["press #compare-plots +"],
        ["press #compare-plots ArrowRight", "press #compare-plots -"], f"{AT}('from') === '231.5'",
    ),
    "keys of a map": (
        SINE_MAP, "map", ["press #map +"], ["press #map +"], f"Math.abs({AT}('x_to') - {AT}('x_from') - 1) < 0.01",
    ),
    "values": (STATUE, "case", ["enter pga 0.45"], ["enter pga 0.5", "enter pga 0.3"], f"{AT}('pga') === '0.3g'"),
    "another description": (
        STATUE, "case", ["enter width 0.3"], ["choose #shape parameters"],
        f"{AT}('alpha') && document.getElementById('derived').textContent.includes('15.3')",
    ),
    "a refused value": (
        STATUE, "code", ["enter width 0.3"], ["enter width -1"],
        f"{IN_CODE}('width=0.3') && {AT}('width') === '0.3' && {MARKED}[0] === 'width'"
        " && document.getElementById('main').classList.contains('old')",
    ),
    "a window": (
        STATUE, "case", ["enter pga 0.45"], ["click [data-zoom=in]"],
        f"{AT}('pga') === '0.45g' && {AT}('from') && Math.abs({AT}('from') - {DRAWN}) < 0.05",
    ),
    "a view that was left": (
        SINE, "compare", ["click [data-view=compare]"], ["click [data-view=response]"],
        f"{IN_CODE}('rocking.simulate(') && {BUTTONS}",
    ),
    "an orbit of a view that was left": (
        SINE, "orbit", ["click [data-view=periodic]"], ["click [data-view=response]"],
        f"{IN_CODE}('rocking.simulate(') && {BUTTONS} && !document.body.dataset.sweep",
    ),
    "a point of a map": (
        SINE_MAP, "map/point", ["click #map-open"], ["enter restitution 0.9"],
        f"{AT}('restitution') === '0.9' && {AT}('view') === 'map' && document.body.dataset.map === 'complete'",
    ),
    "a point of the map before": (
        SINE_MAP, "map", ["choose #map-y restitution"], ["press #map Enter"],
        f"!{AT}('view') && document.getElementById('problem').hidden",
    ),
    "a quantity of a map": (
        SINE_MAP, "map", ["choose #map-x p"], ["choose #map-quantity peak"],
        f"{AT}('x') === 'p' && {AT}('quantity') === 'peak' && document.body.dataset.map === 'complete'",
    ),
    "a time": (
        f"{STATUE}&from=231&to=235&at=232.5", "at", ["press #at-slider ArrowLeft"], ["press #at-slider ArrowLeft"],
        "document.getElementById('said').textContent.startsWith('At 232.492')",
    ),
}  # fmt: skip


@pytest.mark.cases(fast=5, thorough=12)
@pytest.mark.parametrize(("query", "path", "asks", "then", "holds"), LATE.values(), ids=LATE)
def test_what_is_chosen_last_is_shown_however_late_an_answer_comes(opened, query, path, asks, then, holds):
    page = opened(query, allowed=["422"])
    if "view=map" in query:
        complete(page)
    page.until(f"document.body.dataset.compared || {'view=compare' not in query:d}")
    with held(page, f"**/api/{path}?*") as waiting:
        acted(page, *asks)
        asked(page, waiting)
        acted(page, *then)
        page.paused(200)
    page.until(holds)
    page.paused(300)
    assert page.js(holds)


@pytest.mark.parametrize(
    ("query", "field"),
    [
        (SINE_MAP, "map-x-to"),
        pytest.param(f"view=periodic&{SINE}&sweep_points=12", "sweep_to", marks=MORE),
        pytest.param(f"view=compare&compare=block&{SINE}", "other-p", marks=MORE),
    ],
)
def test_a_mistake_in_a_view_is_marked_there_and_gone_with_the_view(opened, query, field):
    page = opened(query, allowed=["422"])
    page.until(f"document.getElementById({field!r})?.checkVisibility()")
    entered(page, field, "nothing")
    page.until("!document.getElementById('problem').hidden")
    assert page.js(MARKED) == [field]
    page.page.click("[data-view=response]")
    page.until("document.getElementById('problem').hidden")


def test_the_last_of_two_files_shakes_the_block_however_late_the_first_arrives(opened):
    page = opened(STATUE)
    # Of no other test: a content keeps the name that it came by first.
    one_, other = (ROWS.replace("0.3", "0.37") + f"1.00,0.{k}\n" for k in (1, 2))
    with held(page, "**/api/records?name=first.csv") as waiting:
        page.js(DROP, ["first.csv", one_])
        asked(page, waiting)
        page.js(DROP, ["second.csv", other])
        page.paused(500)
    key = hashlib.sha256(other.encode()).hexdigest()[:24]
    page.until(f"location.search.includes('{key}')")
    page.paused(500)
    assert query_of(page)["motion"] == f"file:{key}" and "'second.csv'" in page.text("#python")


# Guided examples


def guided(page):
    return page.text("#examples-title"), page.js("document.activeElement.id"), query_of(page).get("step")


def test_an_example_is_followed_by_keys_and_by_the_browsers_history(opened):
    page = opened(f"view=block&{STATUE}&at=232.686")
    keys = page.page.keyboard
    assert page.page.locator("#examples").is_hidden()
    page.page.focus("#to-examples")
    keys.press("Enter")
    page.until("document.activeElement.textContent === 'A statue in an earthquake'")
    assert page.page.locator("#examples-list button").count() == 6
    keys.press("Tab")
    page.rested(lambda: keys.press("Enter"))
    assert guided(page) == ("Housner's water tank: step 1 of 3", "example-words", "1")
    assert "at" not in query_of(page)  # a time of the case that was left
    keys.press("Tab")
    page.rested(lambda: keys.press("Enter"))
    assert guided(page) == ("Housner's water tank: step 2 of 3", "example-words", "2")
    assert "23\u00a0%" in page.page.locator("#example-words").text_content()
    assert "23 % of the overturning" in page.text("#verdict") and page.page.locator("#example-left").is_hidden()
    page.rested(lambda: page.page.go_back())
    assert guided(page) == ("Housner's water tank: step 1 of 3", "example-words", "1")
    assert page.text("#verdict") == "It overturns, 1.50 s after the start."
    keys.press("Escape")
    assert page.page.locator("#examples").is_hidden()
    assert page.js("document.getElementById('to-examples').getAttribute('aria-expanded')") == "false"
    assert page.js("document.activeElement.id") == "to-examples" and "example" not in query_of(page)


def test_a_link_to_a_step_is_enough_also_on_a_phone_and_a_changed_case_is_said_to_be_another(opened):
    page = opened("example=critical-sine&step=3", {"width": 320, "height": 700}, bypass_csp=True)
    found = query_of(page)
    assert (found["p"], found["model"], found["step"]) == ("1", "linear", "3")
    assert page.js("document.documentElement.scrollWidth <= window.innerWidth")
    assert page.js("document.getElementById('example-words').getAttribute('aria-live')") == "polite"
    again = page.page.locator("#example-again")
    assert again.is_hidden()
    page.page.click("#to-settings")
    restitution = page.page.locator("#restitution")
    page.rested(lambda: (restitution.fill("0.9"), restitution.press("Enter")))
    page.page.click("#to-settings")
    assert again.is_visible() and query_of(page)["restitution"] == "0.9"
    page.js(tool("axe-core/axe.min.js").read_text("utf-8") + "; 1")
    assert barriers(page, "{include: ['#examples', 'header']}") == []
    page.rested(lambda: again.click())
    assert again.is_hidden() and query_of(page)["restitution"] == "0.92"


def test_a_step_of_the_compare_view_shows_both_responses_that_it_tells_of(opened):
    page = opened("example=threshold&step=1")
    page.page.click("#example-next")
    page.says("compare-verdict", "overturns, 236.17 s")
    assert page.page.locator("#example-left").is_hidden() and "236.17 s" in page.text("#example-words")
    page.page.select_option("#compare-with", "block")
    page.until("!document.getElementById('example-left').hidden", "the case is said to be another")
    assert page.page.locator("#example-next").is_enabled()


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


# Where the keys are: no action loses them, and what has them is seen.

HAS_KEYS = "document.activeElement.id || document.activeElement.textContent || document.activeElement.tagName"
#: Name of what has the keys, and whether it is seen at one of nine points; null for the page itself.
SEEN = """new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))).then(() => {
  const on = document.activeElement, box = on.getBoundingClientRect();
  if (on === document.body || !document.hasFocus()) return null; // the keys are beyond the page
  const shares = [0.2, 0.5, 0.8];
  const at = (x, y) => document.elementFromPoint(box.x + x * box.width, box.y + y * box.height);
  const hits = shares.flatMap((x) => shares.map((y) => at(x, y)));
  return [on.id || on.textContent, hits.some((hit) => hit && (on.contains(hit) || hit.closest("label")?.contains(on)))];
})"""


def press(page, *keys):
    for key in keys:
        page.page.keyboard.press(key)


def test_a_choice_that_is_drawn_anew_keeps_the_keys(opened):
    page = opened(STATUE)
    button = page.page.locator("#sequences button").first
    button.focus()
    press(page, "Enter")
    page.until("location.search.includes('from=')")
    assert page.js(HAS_KEYS) == "Show 1"
    page.page.click("[data-view=records]")
    page.until(LISTED)
    page.page.focus(".sorting >> nth=1")
    press(page, "Enter")
    assert page.js(HAS_KEYS) == "PGA"
    with page.page.expect_event("load"):
        page.page.focus("#length_in")
        page.page.select_option("#length_in", "cm")
    page.until("document.body.dataset.ready && document.activeElement.id === 'length_in'", timeout=10.0)


@pytest.mark.parametrize(
    ("viewport", "view"),
    [
        (DESK, "response"),
        pytest.param(DESK, "block&lecture=1", marks=MORE),
        pytest.param(DESK, "map", marks=MORE),
        pytest.param(PHONE, "response", marks=MORE),
        (PHONE, "map"),
    ],
    ids=["response", "lecture", "map", "response on a phone", "map on a phone"],
)
def test_what_has_the_keys_is_seen(opened, view, viewport):
    page = opened(f"{STATUE}&view={view}&points=20", viewport)
    hidden, judged = [], 0
    for key in ("Tab", "Shift+Tab"):
        for _ in range(60):
            press(page, key)
            if found := page.js(SEEN):
                judged += 1
                hidden += [] if found[1] else [(key, found[0])]
    assert hidden == [] and judged > 60
