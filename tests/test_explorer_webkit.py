"""The explorer's page in WebKit: every view, a changed value, the way back, a file, and no complaint."""

import json

import numpy as np
import pytest
from explorer_browser import BROWSER
from explorer_webkit import windows

import rocking
from rocking.explorer.core import Explorer
from rocking.explorer.launch import served

pytestmark = [
    pytest.mark.browser,
    pytest.mark.skipif(BROWSER != "webkit", reason="ROCKING_BROWSER says which browser: this is not webkit"),
]

STATUE = {"width": "0.24", "height": "1.1", "motion": "ridgecrest-clc-090", "pga": "0.4g"}
SINE = {"p": "2", "alpha": "0.2", "restitution": "0.92", "motion": "sine:amplitude=2.02,frequency=0.6366,cycles=2.5"}
PEAK = "document.querySelector('#figures dd').textContent"
QUERY = "Object.fromEntries(new URLSearchParams(location.search))"
#: What holds when a view has computed all that it shows.
COMPUTED = {
    "response": "document.querySelectorAll('#histories .bk-Canvas, #histories > *').length > 0",
    "block": "document.getElementById('stage').dataset.shown",
    "map": "document.body.dataset.map === 'complete'",
    "periodic": "document.body.dataset.sweep === 'complete'",
    "compare": "document.body.dataset.compared",
    "records": "document.querySelectorAll('[data-record]').length > 5",
    "assessment": "document.body.dataset.assessment === 'complete'",
}


@pytest.fixture(scope="module")
def here():
    running = served(Explorer(), {})
    running.run_in_background()
    yield running
    running.server.should_exit = True


@pytest.fixture(scope="module")
def window():
    with windows() as opened:
        yield opened


@pytest.fixture
def opened(window, here):
    """Open the page with texts; in the end nothing may have gone wrong on it."""

    def open_page(**texts):
        window.open(here.link(texts))
        return window

    yield open_page
    assert window.js("window.complaints") == []


def typed(page, name, text):
    """Type into a field by keys, and wait for the response."""
    before = page.js("Number(document.body.dataset.rested)")
    (field,) = page.call("/element", using="css selector", value=f"#{name}").values()
    page.js(f"document.getElementById({name!r}).select()")
    page.call(f"/element/{field}/value", text=f"{text}\ue007")
    page.until(f"Number(document.body.dataset.rested) > {before}", "the page is drawn again")


def peak_of(**sizes):
    motion = rocking.records.load("ridgecrest-clc-090").scaled_to(0.4 * 9.80665)
    return rocking.simulate(rocking.Block(**sizes), motion).peak_over_slenderness


def test_a_typed_value_changes_the_response_and_the_way_back_returns_to_the_one_before(opened):
    page = opened(**STATUE)
    assert float(page.js(PEAK).split(" ")[0]) == pytest.approx(peak_of(width=0.24, height=1.1), rel=2e-3)
    typed(page, "width", "0.3")
    assert float(page.js(PEAK).split(" ")[0]) == pytest.approx(peak_of(width=0.3, height=1.1), rel=2e-3)
    page.until(f"{QUERY}.width === '0.3'")
    page.call("/back")
    page.until(f"{QUERY}.width === '0.24' && document.getElementById('width').value === '0.24'")
    page.until(f"{PEAK}.startsWith('0.2')")


def test_every_view_is_computed_and_drawn(opened):
    page = opened(**SINE, points="16", sweep_points="8", levels="4")
    judged = 0
    for view, computed in COMPUTED.items():
        page.click(f"[data-view={view}]")
        page.until(computed, view)
        page.until(f"document.title.startsWith({view.capitalize()!r})", view)
        assert page.js("document.getElementById('problem').hidden"), view
        assert page.js("document.documentElement.scrollWidth <= innerWidth"), view
        judged += 1
    assert judged == len(COMPUTED) == 7


def test_what_is_drawn_is_the_engines_own(opened):
    page = opened(**STATUE)
    line = page.js("""(() => {
      const source = Bokeh.documents.map((each) => each.get_model_by_name('histories-first')).filter(Boolean)[0];
      const {origin, unit} = document.getElementById('histories').dataset;
      return [Number(origin), Number(unit), Array.from(source.data.x), Array.from(source.data.y)];
    })()""")
    motion = rocking.records.load("ridgecrest-clc-090").scaled_to(0.4 * 9.80665)
    response = rocking.simulate(rocking.Block(width=0.24, height=1.1), motion)
    times = line[0] + np.array(line[2]) * line[1]
    assert len(times) > 500
    assert np.abs(np.array(line[3]) - response.rotation(times) / response.block.alpha).max() < 1e-11
    canvas = "document.querySelector('#histories').querySelector('*').shadowRoot"
    assert page.js(f"{canvas} !== null")


def test_a_record_is_dropped_told_about_and_shakes_the_block(opened):
    page = opened(**STATUE)
    rows = "\\n".join(f"{0.01 * k:.2f},{0.3 * (-1) ** (k // 20)}" for k in range(100))
    text = json.dumps(f"time (s),a (g)\\n{rows}\\n").replace("\\\\n", "\\n")
    page.js(f"""(() => {{
      const given = new DataTransfer();
      given.items.add(new File([{text}], 'record.csv'));
      for (const kind of ['dragenter', 'dragover', 'drop'])
        document.querySelector('main').dispatchEvent(
          new DragEvent(kind, {{dataTransfer: given, bubbles: true, cancelable: true}}));
    }})()""")
    page.until(f"({QUERY}.motion ?? '').startsWith('file:')")
    page.until("document.getElementById('python').textContent.includes('record.csv')")
    assert "record.csv" in page.text("command")


def test_a_number_that_is_none_is_answered_with_a_sentence_in_every_view(opened):
    page = opened(**STATUE)
    field = "document.getElementById('width')"
    page.js(f"({field}.value = '-1', {field}.dispatchEvent(new Event('change', {{bubbles: true}})))")
    page.until("!document.getElementById('problem').hidden")
    assert page.text("problem").startswith("“Width” must be a positive number")
