"""The standalone page: its kernels against the package, its file, and what people do with it, in a browser."""

import base64
import gzip
import itertools
import json
import re
import runpy
from pathlib import Path
from urllib.parse import parse_qsl

import numpy as np
import pytest
from explorer_browser import Watched, launched, tool

import rocking
from rocking import pulses
from rocking.errors import OptionError, RecordError
from rocking.explorer import standalone
from rocking.explorer.core import Explorer
from rocking.explorer.launch import Server
from rocking.kernels import library, state
from rocking.simulation.simulate import compute_response

CASES = 1000
KINDS = (*standalone.PULSE_NAMES, "sine", "tilt", *standalone.RECORD_NAMES)

#: Outcomes of cases, as the workers of the page compute them.
OUTCOMES = """async (cases) => {
  const kernels = await openKernels();
  return cases.map((given) => {
    const body = bodyOf(given, kernels.exports), found = kernels.march(body, shakingOf(given), startOf(given), true);
    const {overturned, impacts, uplifts, rests, end, peak} = found;
    return [Number(overturned), impacts, uplifts, rests, end, peak, ...found.events.map(({time}) => time)];
  });
}"""


@pytest.fixture(scope="module")
def built():
    if not library.read_manifest()["page"]:
        pytest.skip("the kernels were built without ziglang")


@pytest.fixture(scope="module")
def html(built):
    return standalone.build_page()


@pytest.fixture(scope="module")
def page_file(html, tmp_path_factory):
    path = tmp_path_factory.mktemp("standalone") / "block.html"
    path.write_text(html, "utf-8")
    return path


@pytest.fixture(scope="module")
def browser():
    with launched() as started:
        yield started


@pytest.fixture
def opened(browser, page_file):
    """Open the page from its file, at an address and a size."""
    contexts = []

    def open_page(address="", width=1280, height=800, **context):
        contexts.append(browser.new_context(viewport={"width": width, "height": height}, **context))
        page = Watched(contexts[-1].new_page())
        page.page.goto(f"{page_file.as_uri()}#{address}")
        page.until("document.body.dataset.ready", "the page is ready")
        return page

    yield open_page
    for context in contexts:
        context.close()


def draw_case(rng, kind):
    """Draw a case of a kind, as the page describes it."""
    alpha, p = rng.uniform(0.05, 0.4), rng.uniform(1.0, 6.0)
    radius = 0.75 * 9.80665 / p**2
    width = 2.0 * radius * np.sin(alpha)
    case = {
        "width": width, "height": 2.0 * radius * np.cos(alpha),
        "offset": rng.choice([0.0, rng.uniform(-0.2, 0.2) * width]),
        "restitution": rng.choice([None, rng.uniform(0.5, 0.97)]), "model": str(rng.choice(["nonlinear", "linear"])),
        "threshold": rng.choice([None, 10.0 ** rng.uniform(-6.0, -1.0)], p=[0.8, 0.2]),
        "motion": kind, "amplitude": rng.uniform(0.5, 6.0) * alpha * 9.80665, "rate": rng.uniform(0.3, 3.0),
        "cycles": float(rng.integers(1, 13)) / 2.0, "tilt": 0.0,
    }  # fmt: skip
    if kind == "tilt":
        case |= {"motion": "one-sine", "tilt": rng.uniform(-0.9, 0.9) * alpha}
    return {name: value.item() if isinstance(value, np.generic) else value for name, value in case.items()}


def simulate_case(case, change=1.0):
    """Simulate a case of the page with the package, under the motion or from the tilt times a factor."""
    kind, amplitude, rate = case["motion"], case["amplitude"] * change, case["rate"]
    block = rocking.Block(
        width=case["width"], height=case["height"], offset=case["offset"], restitution=case["restitution"]
    )
    scheme = "certified" if case["threshold"] is None else f"velocity={case['threshold']!r}"
    initial = (case["tilt"] * change, 0.0)
    if case["tilt"]:
        return compute_response(block, None, case["model"], scheme, None, initial)
    if kind in standalone.RECORD_NAMES:
        motion = rocking.records.load(kind)
        amplitude /= motion.pga
    elif kind == "sine":
        motion = pulses.sine(1.0, rate, cycles=case["cycles"])
    else:
        motion = getattr(pulses, kind.replace("-", "_"))(1.0, rate)
    return compute_response(block, motion, case["model"], scheme, None, initial, factor=amplitude)


def outcome_of(response):
    """Counts, end, peak and times of the events of a response, as `OUTCOMES` returns them."""
    kinds = response.events["kind"].tolist()
    counts = [len(response.impacts), kinds.count("uplift"), kinds.count("rest")]
    return [*counts, response.duration, abs(response.peak_rotation), *response.events["time"]]


def has_equal_events(first, second):
    """Whether uplifts and rests are equal, and times within 1e-11 s."""
    return (
        len(first) == len(second)
        and first[1:3] == second[1:3]
        and np.allclose(first[3:], second[3:], rtol=0.0, atol=1e-11)
    )


@pytest.mark.browser
def test_outcomes_are_those_of_the_package(opened):
    rng = np.random.default_rng(20261129)
    cases = [draw_case(rng, kind) for kind in np.resize(KINDS, CASES).tolist()]
    computed = opened().js(OUTCOMES, cases)
    fallen, sensitive, recounted = 0, [], 0
    for case, (overturned, *outcome) in zip(cases, computed, strict=True):
        response = simulate_case(case)
        assert bool(overturned) == response.overturned, case
        fallen += overturned
        expected = outcome_of(response)
        if not has_equal_events(outcome, expected):  # then the package itself differs as much after a last bit
            sensitive.append(case["motion"])
            neighbours = [simulate_case(case, 1.0 + k * 2.0**-52) for k in (-2, -1, 1, 2)]
            assert not all(has_equal_events(outcome_of(each), expected) for each in neighbours), case
        elif outcome[0] != expected[0]:  # a last bit decides after how many impacts a bound on the rest suffices
            recounted += 1
            assert abs(outcome[0] - expected[0]) < 0.05 * expected[0], case
    assert 0.2 * CASES < fallen < 0.8 * CASES
    assert set(sensitive) <= {"ridgecrest-clc-090"} and len(sensitive) <= 0.03 * CASES and recounted <= 0.002 * CASES


@pytest.mark.browser
def test_sines_rest_below_the_critical_amplitude(opened):
    address = f"{SLENDER}&motion=sine:amplitude=2,frequency=0.63,cycles=2.5"
    page = opened(address)
    page.page.click("[data-panel=map]")
    page.page.click("button[value=sines]")
    page.until("document.body.dataset.map === 'complete'", "the map is computed")
    values = np.array(page.js("Array.from(page.panels.map.values)")).reshape(96, 128)
    omega = 0.5 * 16.0 ** ((np.arange(128) + 0.5) / 128)
    a = 1.0 + 0.1 * (np.arange(96) + 0.5) / 96
    critical = rocking.chattering.critical_amplitude(omega, 0.92)
    rests = values == 0.0
    assert (rests == (a[:, None] < critical)).all() and 3000 < rests.sum() < 5000
    assert {0.0, 1.0, 2.0} == {*values.ravel().tolist()}


@pytest.mark.browser
def test_the_explorer_opens_on_the_page_and_both_share_the_case(built, browser):
    server = Server(Explorer())
    server.run_in_background()
    context = browser.new_context(viewport={"width": 1280, "height": 800})
    page = Watched(context.new_page())
    page.page.goto(server.create_link(path="/block"))
    page.until("document.body.dataset.settled", "computed")
    page.until("!location.hash.includes('token')", "the token is redeemed")
    assert page.text("#question") == "Will it fall?" and page.page.locator("#ask").is_visible()
    page.js("location.hash = 'width=0.3&height=1.3&offset=0.02&motion=one-sine:amplitude=0.4g,frequency=1'")
    page.until("document.getElementById('more').search.includes('width=0.3&')", "the link has the case")
    page.page.click("#more")
    page.until("document.body?.innerText.includes('overturns')", "the explorer shows the case")
    page.page.click("#to-block")
    page.until("document.getElementById('headline')?.textContent.includes('It falls.')", "the page shows the case")
    page.until("location.hash.includes('amplitude=3.92266,')", "the case is in the address")
    assert numbers(page)["offset"] == 0.02 and page.complaints == []
    server.server.should_exit = True
    context.close()


def test_without_webassembly_the_explorer_opens_itself(monkeypatch, run):
    opened = []
    monkeypatch.setattr(library, "read_manifest", lambda: {"page": None})
    monkeypatch.setattr(Server, "announce", lambda self, *, open_browser, path="/": opened.append(path))
    monkeypatch.setattr(Server, "run", lambda self: self.socket.close())
    code, _, err = run("explore", "--no-open")
    assert (code, opened) == (0, ["/"]) and "needs WebAssembly" in err


def test_links_of_a_class_are_in_the_page_and_checked(built, tmp_path):
    path = tmp_path / "links.txt"
    first, second = "width=0.3&height=1.2&motion=one-sine:amplitude=0.35g,frequency=1.2&ask=1", "width=0.3&height=1.2"
    path.write_text(f"# Week 3\n\nWill it fall? block.html#{first}\n{second}\n", "utf-8")
    entries = standalone.read_exercises(path)
    links = [{"words": "Will it fall?", "case": first}, {"words": second, "case": second}]
    assert entries == [{"words": "Week 3"}, *links]
    assert json.dumps(entries, separators=(",", ":")).replace("<", "\\u003c") in standalone.build_page([], path)


@pytest.mark.parametrize(
    ("link", "problem"),
    [
        ("width=0.3&height=tall", "height must be a length"),
        ("width=0.3&heigh=1", "the page cannot show 'heigh'; it shows width"),
        ("width=0.3&height=1&motion=nowhere&pga=2", "the page has no motion named 'nowhere'; it has sine, one-sine"),
        ("width=0.3&height=1&motion=sine:amplitude=1", "frequency"),
    ],
)
def test_a_wrong_link_of_a_class_is_refused_with_its_line(link, problem, tmp_path):
    path = tmp_path / "links.txt"
    path.write_text(f"\nA link  {link}\n", "utf-8")
    with pytest.raises(OptionError, match=f"links.txt, line 2: .*{re.escape(problem)}"):
        standalone.read_exercises(path)
    with pytest.raises(OptionError, match="cannot be read"):
        standalone.read_exercises(tmp_path / "none.txt")


@pytest.mark.browser
def test_a_class_opens_its_links(built, browser, tmp_path):
    links, path = tmp_path / "links.txt", tmp_path / "block.html"
    links.write_text(f"# Week 3\nDoes it fall?  #{FALLING}&ask=1\n", "utf-8")
    path.write_text(standalone.build_page([], links), "utf-8")
    context = browser.new_context()
    page = Watched(context.new_page())
    page.page.goto(path.as_uri())
    page.until("document.body.dataset.settled", "computed")
    assert page.page.locator("#tours").is_visible()
    assert not any("record" in title for title in page.page.locator(".tours button").all_text_contents())
    page.page.click("text=Does it fall?")
    page.page.click("#yes")
    page.says("headline", "You were right. It falls.")
    context.close()


@pytest.mark.thorough
def test_the_file_is_small_whole_and_refuses_what_it_cannot_hold(html, monkeypatch):
    assert len(gzip.compress(html.encode())) <= standalone.MAX_SIZE
    names = re.findall(r"^(?:async )?(?:const|let|function|class) (\w+)", html, re.MULTILINE)
    assert len(names) == len({*names}) > 100
    assert not re.search(r"/\*[A-Z]+\*/|^(?:import|export) ", html, re.MULTILINE)
    assert not re.search(r"""(?:src|href)=["'](?!data:)""", html)
    with pytest.raises(RecordError, match="no shipped record is named 'nowhere'"):
        standalone.build_page(["nowhere"])
    monkeypatch.setattr(standalone, "MAX_SIZE", 20_000)
    with pytest.raises(OptionError, match=r"at most 20 kB compressed, but would have \d+ kB; choose fewer or shorter"):
        standalone.build_page([])


@pytest.mark.parametrize("wanted", [True, False])
def test_a_build_without_the_page_needs_no_ziglang(wanted, monkeypatch):
    monkeypatch.setenv("ROCKING_PAGE", str(int(wanted)))
    libraries = runpy.run_path(str(Path(__file__).parents[1] / "compiling" / "libraries.py"))
    assert libraries["_made"]()["page"] is wanted
    monkeypatch.setitem(libraries["dependencies"].__globals__, "is_current", lambda: False)
    assert (libraries["ZIG"] in libraries["dependencies"]()) is wanted
    assert {*libraries["REQUIREMENTS"]} <= {*libraries["dependencies"]()}


def test_the_command_writes_the_file(built, run, tmp_path):
    path = tmp_path / "block.html"
    code, out, err = run("page", "--records", "", "--out", path)
    assert (code, err) == (0, "")
    assert out == f"written to {path}: {path.stat().st_size // 1000} kB; open it in a browser\n"
    assert path.read_text("utf-8") == standalone.build_page([])
    code, out, err = run("page", "--out", tmp_path / "nowhere" / "block.html", "--records", "")
    assert code == 2 and "cannot be written" in err and out == ""


def test_without_webassembly_the_page_is_refused(monkeypatch):
    manifest = library.read_manifest() | {"page": None}
    monkeypatch.setattr(library, "read_manifest", lambda: manifest)
    with pytest.raises(OptionError, match="no WebAssembly for the page, because ziglang was not available"):
        standalone.build_page()


def test_the_webassembly_imports_nothing(built):
    wasm = base64.b64decode(standalone.describe_computation([])["wasm"])
    sections, at = [], 8
    while at < len(wasm):
        size, shift = 0, 0
        number, at = wasm[at], at + 1
        while True:
            byte, at = wasm[at], at + 1
            size |= (byte & 127) << shift
            shift += 7
            if byte < 128:
                break
        sections.append(number)
        at += size
    assert at == len(wasm) and 10 in sections  # code
    assert 2 not in sections  # imports


def test_results_are_the_same_in_every_browser(html):
    core = html[html.index('<script id="core">') :].partition("</script>")[0]
    assert len(core) > 20_000
    code = re.sub(r"/\*.*?\*/|//[^\n]*", "", core, flags=re.DOTALL)
    exact = {"PI", "sqrt", "abs", "sign", "max", "min", "floor", "ceil", "round"}
    assert {*re.findall(r"Math\.(\w+)", code)} <= exact  # others are approximated by each browser as it likes
    assert "**" not in code


def test_layouts_are_those_of_the_records(built):
    layouts = standalone.describe_computation([])["layouts"]
    assert layouts["state"]["size"] == state.STATE_DTYPE.itemsize
    for name, (offset, _, count) in layouts["block"]["fields"].items():
        field, start = state.BLOCK_DTYPE.fields[name][:2]
        assert (start, field.itemsize) == (offset, count * field.itemsize // max(count, 1))
    offset, kind, count = layouts["table"]["fields"]["impact.speed_after"]
    table = state.create_table(1)
    table["impact"]["speed_after"] = 2.5
    assert (kind, count) == ("f8", 1)
    assert np.frombuffer(table.tobytes()[offset : offset + 8]) == 2.5


def drag(page, selector, across, up):
    """Drag an element by pixels, and wait until all that follows is computed."""
    box = page.page.locator(selector).bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    settled = page.js("document.body.dataset.settled ?? '0'")
    page.page.mouse.move(x, y)
    page.page.mouse.down()
    page.page.mouse.move(x + across, y - up, steps=6)
    page.page.mouse.up()
    page.until(f"Number(document.body.dataset.settled) > {settled}", "the case is computed")


def numbers(page):
    """Numbers of the case in the address."""
    fields = dict(parse_qsl(page.js("location.hash.slice(1)")))
    fields |= dict(part.split("=") for part in fields.pop("motion").partition(":")[2].split(",") if part)
    return {name: float(value) for name, value in fields.items()}


#: Controls of the screen, and words that are seen.
CONTROLS = """[...document.querySelectorAll("button, input, select, a, summary, canvas")]
  .filter((each) => each.checkVisibility()).length"""
WORDS = """(() => {
  const count = (text) => text.match(/\\p{L}{2,}/gu)?.length ?? 0;
  return count(document.body.innerText) - count(document.getElementById("described").innerText);
})()"""
SLENDER = "width=0.730609&height=3.604203&restitution=0.92&model=linear"
FALLING = "width=0.4&height=1.6&motion=one-sine:amplitude=3.1,frequency=1"


@pytest.mark.browser
def test_the_first_screen_asks_and_playing_answers(opened):
    page = opened()
    assert page.js(CONTROLS) <= 10
    words = page.js(WORDS)
    assert words <= 60
    assert page.text("h1") == "Make it fall." and page.page.locator("#play").is_visible()
    assert page.page.locator("#why li").count() == 0
    page.page.click("#no")
    page.until("document.body.dataset.played", "the motion has been shown")
    page.says("headline", "You were right. It stands.")
    block, pulse = rocking.Block(width=0.4, height=1.6), pulses.one_sine(3.01, 1.0)
    response = rocking.simulate(block, pulse)
    assert 0.7 < response.peak_rotation / block.alpha < 1.0
    assert f"{100 * response.peak_rotation / block.alpha:.1f} % of the way" in page.text("#why")
    page.says("headline", "0.3091 g")
    assert not rocking.simulate(block, pulses.one_sine(0.3090 * 9.80665, 1.0)).overturned
    assert rocking.simulate(block, pulses.one_sine(0.3092 * 9.80665, 1.0)).overturned
    assert page.complaints == [] and page.hosts <= {"", "data"}


@pytest.mark.browser
def test_all_that_is_drawn_can_be_dragged(opened):
    page = opened()
    drag(page, "#strip .pulse .knob", 0, 12)
    page.says("headline", "It falls.")
    after = numbers(page)
    assert after["amplitude"] > 3.1 and after["frequency"] == pytest.approx(1.0)
    drag(page, "#strip .pulse .knob", 40, 0)
    assert numbers(page)["frequency"] < 0.9
    drag(page, "#scene .top .knob", 0, -60)
    drag(page, "#scene .side .knob", 30, 0)
    drag(page, "#scene .mass .knob", 12, 0)
    after = numbers(page)
    assert after["height"] < 1.5 and after["width"] > 0.5 and after["offset"] > 0.0
    box = page.page.locator("#scene .block").bounding_box()
    page.page.mouse.move(box["x"] + 12, box["y"] + 80)
    page.page.mouse.down()
    page.page.mouse.move(box["x"] + 60, box["y"] + 80, steps=6)
    page.page.mouse.up()
    page.until("play.textContent === 'Pause'", "the block is let go")
    page.until("location.hash.includes('initial_rotation')", "the tilt is in the address")
    assert numbers(page)["initial_rotation"] > 0.02
    page.page.locator("#strip .link").click()
    page.until("page.given.tilt === 0", "the block stands upright under the pulse again")
    page.js("location.hash = 'width=0.4&height=1.6&motion=one-sine:amplitude=4.4,frequency=2'")
    page.until("page.given.amplitude === 4.4", "another pulse is shown")
    assert page.js("page.strip.knobTime") == pytest.approx(0.125, abs=0.01)  # on the first of two equal lobes
    assert page.complaints == []


@pytest.mark.browser
def test_moments_are_those_of_the_package(opened):
    page = opened(FALLING)
    page.says("headline", "It falls.")
    block, pulse = rocking.Block(width=0.4, height=1.6), pulses.one_sine(3.1, 1.0)
    response = rocking.simulate(block, pulse)
    times = [float(text.split()[0]) for text in page.page.locator("#why button").all_text_contents()]
    lift, gone, balance = times
    assert lift == pytest.approx(response.events["time"][0], abs=0.005)
    assert balance == pytest.approx(response.tipping_time, abs=0.005)

    def falls(stop):  # if the ground stops then
        rotation, velocity, _ = response.states(stop)
        start = {"initial_rotation": float(rotation), "initial_velocity": float(velocity)}
        return rocking.simulate(block, None, **start).overturned

    assert not falls(gone - 0.006) and falls(gone + 0.006)
    page.page.locator("#why button").nth(1).click()
    assert page.text("#clock") == f"{gone:.2f} s"


@pytest.mark.browser
def test_the_map_marks_the_case_and_the_case_can_be_dragged_over_it(opened):
    page = opened(FALLING)
    page.page.click("[data-panel=map]")
    page.until("document.body.dataset.map === 'complete'", "the map is computed")
    box = page.page.locator("#map canvas").bounding_box()
    page.page.mouse.move(box["x"] + 60, box["y"] + 250)
    page.page.mouse.down()
    page.page.mouse.move(box["x"] + 70, box["y"] + 260, steps=3)
    page.page.mouse.up()
    page.says("headline", "It stands.")
    page.until("!location.hash.includes('amplitude=3.1,')", "the address is another")
    before = numbers(page)
    page.page.focus("#map canvas")
    page.page.keyboard.press("ArrowUp")
    page.until(f"!location.hash.includes('amplitude={before['amplitude']}')", "the key has moved the case")
    after = numbers(page)
    assert after["amplitude"] > before["amplitude"] and after["frequency"] == before["frequency"]
    response = rocking.simulate(
        rocking.Block(width=0.4, height=1.6), pulses.one_sine(after["amplitude"], after["frequency"])
    )
    assert not response.overturned and page.complaints == []


@pytest.mark.browser
def test_fields_show_and_send_every_digit(opened):
    page = opened(FALLING)
    page.page.click("[data-panel=numbers]")
    page.page.fill("[aria-label='Width, m']", "0.41234567890123")
    page.page.keyboard.press("Enter")
    page.until("location.hash.includes('width=0.41234567890123&')", "the address has every digit")
    page.page.fill("[aria-label='Amplitude, g']", "3 m/s2")
    page.page.keyboard.press("Enter")
    page.until("location.hash.includes('amplitude=3,')", "units are read")
    page.page.fill("[aria-label='Height, m']", "tall")
    page.page.keyboard.press("Enter")
    assert page.page.get_attribute("[aria-label='Height, m']", "aria-invalid") == "true"
    page.page.focus("#n-length")
    page.page.keyboard.press("Shift+ArrowRight")
    page.until("!location.hash.includes('frequency=1&') && !location.hash.endsWith('frequency=1')", "a fine step")
    assert 0.995 < numbers(page)["frequency"] < 1.0


@pytest.mark.browser
def test_the_keyboard_reaches_all_and_returns(opened):
    page = opened(FALLING)
    keys, on = page.page.keyboard, "document.activeElement.dataset.panel ?? document.activeElement.id"
    keys.press("Tab")
    assert page.js(on) == "numbers"
    keys.press("Enter")
    assert page.js(on) == "close" and page.page.locator("#numbers").is_visible()
    keys.press("Tab")
    assert page.js(on) == "motion"
    keys.press("Escape")
    assert page.js(on) == "numbers" and page.page.locator("#panel").is_hidden()
    for name in ("map", "phase", "tours", "play", "time"):
        keys.press("Tab")
        assert page.js(on) == name
    keys.press("End")
    page.until("document.getElementById('clock').textContent === '2.78 s'", "the time line is at its end")
    assert page.page.get_attribute("#time", "aria-valuetext") == "2.78 s"
    page.page.click("[data-panel=tours]")
    page.page.click(".tours button >> nth=0")
    assert page.page.locator(".card p:focus").count() == 1
    keys.press("Escape")
    assert page.js(on) == "tours" and page.page.locator("#panel").is_hidden()
    page.page.focus("#yes")
    keys.press("Enter")
    assert page.js(on) == "play"


@pytest.mark.browser
@pytest.mark.parametrize(
    ("width", "height"), [pytest.param(1280, 800, marks=pytest.mark.thorough), (390, 844)], ids=["desk", "phone"]
)
def test_tours_point_at_what_is_on_the_screen(opened, width, height):
    page = opened("", width, height)
    page.page.click("[data-panel=tours]")
    page.page.click(".tours button >> nth=0")
    seen, outlined = set(), 0
    while (title := page.text(".card h2")) not in seen or page.js(
        "document.querySelector('.card .soft').textContent !== 'Step 1 of 3'"
    ):
        seen.add(title)
        page.paused(60)
        place = page.js(
            "(() => { const box = document.querySelector('.marked')?.getBoundingClientRect();"
            "return box && [box.left, box.top, box.right, box.bottom]; })()"
        )
        if place:
            outlined += 1
            assert min(place[:2]) > -1.0 and place[2] < width + 1.0 and place[3] < height + 1.0, title
        page.page.click(".card .main")
    page.page.click("#close")
    assert len(seen) == 7 and outlined >= 16 and page.complaints == []


@pytest.mark.browser
@pytest.mark.parametrize(
    ("width", "scheme"), [(1280, "light"), (390, "dark"), pytest.param(1920, "dark", marks=pytest.mark.thorough)]
)
def test_no_panel_has_a_barrier(opened, width, scheme):
    page = opened(FALLING, width, 844, color_scheme=scheme, bypass_csp=True, reduced_motion="reduce")
    page.js(tool("axe-core/axe.min.js").read_text("utf-8") + "; 1")
    for panel in ("numbers", "map", "phase", "tours"):
        page.page.click(f"[data-panel={panel}]")
        page.paused(100)
        found = page.js("axe.run().then(({violations}) => violations.map(({id, nodes}) => [id, nodes[0].html]))")
        assert found == [], panel
        assert page.js("document.documentElement.scrollWidth") <= width
    left = "element.getBoundingClientRect().left"
    assert page.js(
        f"[...strip.querySelectorAll('text'), strip].every((element) => {left} >= strip.getBoundingClientRect().left)"
    )
    assert page.complaints == []


@pytest.mark.browser
def test_a_case_in_the_address_is_shown_again(opened):
    address = (
        "width=0.5&height=2&offset=0.05&restitution=0.9&motion=sine:amplitude=2,frequency=0.8,cycles=2.5&model=linear"
    )
    page = opened(address)
    page.until("document.body.dataset.settled", "computed")
    assert dict(parse_qsl(page.js("location.hash.slice(1)"))) == dict(parse_qsl(address))
    page = opened(f"{FALLING}&ask=1")
    page.page.click("#yes")
    page.says("headline", "You were right. It falls.")
    page = opened("width=nonsense&motion=unknown:amplitude=x&height=1e9&p=2")
    page.until("document.body.dataset.settled", "computed")
    page.says("headline", "This page cannot show all of the address: motion, width, amplitude, height, p.")
    assert numbers(page) == {"width": 0.4, "height": 10.0, "amplitude": 3.01, "frequency": 1.0}


@pytest.mark.browser
@pytest.mark.parametrize("width", [1280, 794])
def test_what_is_printed_hides_nothing(opened, width):
    page = opened(FALLING, width, 1123, color_scheme="dark")
    page.page.click("[data-panel=map]")
    page.until("document.body.dataset.map === 'complete'", "the map is computed")
    page.page.emulate_media(media="print")
    page.paused(100)
    tops = [page.page.locator(f"#{name}").bounding_box() for name in ("stage", "strip", "answer", "panel")]
    assert all(above["y"] + above["height"] <= below["y"] for above, below in itertools.pairwise(tops))
    assert not page.page.locator("nav, #transport, #close, .buttons, .knob >> visible=true").count()
    corner = page.js("[...page.panels.map.picture.getContext('2d').getImageData(0, 95, 1, 1).data]")
    assert corner == [255, 255, 255, 255]  # paper


@pytest.mark.browser
def test_no_case_of_an_address_blocks_the_page(opened):
    shapes = ["width=0.02&height=50", "width=0.4&height=1.6&restitution=1", "width=50&height=0.02&offset=9"]
    motions = ["none&initial_rotation=0.1", "one-sine:amplitude=0.01,frequency=1", "ridgecrest-clc-090&pga=100"]
    page = opened()
    for case in (f"{shape}&motion={motion}" for shape in shapes for motion in motions):
        took = page.js(
            "(text) => { const began = performance.now(); page.show(text, false); return performance.now() - began; }",
            case,
        )
        page.says("headline", "This page cannot show all of the address")
        assert took < 5_000.0, case


@pytest.mark.browser
def test_without_workers_the_page_computes_by_itself(browser, page_file):
    context = browser.new_context()
    context.add_init_script("window.Worker = class { constructor() { throw new Error('refused'); } };")
    page = Watched(context.new_page())
    page.page.goto(page_file.as_uri())
    page.until("document.body.dataset.settled", "the critical amplitude is computed")
    page.page.click("#no")
    page.says("headline", "0.3091 g")
    context.close()


@pytest.mark.browser
def test_a_browser_without_webassembly_is_told(browser, page_file):
    context = browser.new_context()
    context.add_init_script("WebAssembly.instantiate = () => Promise.reject(new Error('refused'));")
    page = Watched(context.new_page())
    page.page.goto(page_file.as_uri())
    page.says("headline", "This browser cannot run the kernels (refused).")
    context.close()
