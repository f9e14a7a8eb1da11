"""The explorer's page in other words and in other locales, in a browser: no text stands beside the file of texts."""

import json
import re
from urllib.parse import parse_qsl, urlencode

import pytest
from explorer_browser import Watched, launched

import rocking
from rocking.explorer.assessment import RULES
from rocking.explorer.core import Explorer
from rocking.explorer.launch import start_listening
from rocking.explorer.server import page_files

pytestmark = pytest.mark.browser

STATUE = "width=0.24&height=1.1&motion=ridgecrest-clc-090&pga=0.4g"
SINE = "p=2&alpha=0.2&restitution=0.92&motion=sine:amplitude%3D2.02,frequency%3D0.6366197723675814,cycles%3D2.5"
#: What is shown of the page: texts, and the attributes and options that are read to people. What is code is none, and
#: sentences of the package itself, numbers in words and the treatments in a table stay English.
SHOWN = """() => {
  const found = [];
  const seen = (each) => each.checkVisibility ? each.checkVisibility() : true;
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const {parentElement: around, data} = walker.currentNode;
    if (!data.trim() || around.closest("script, pre, .unit, .package, h1.name, #words")) continue;
    if (!seen(around) && !around.closest("select")) continue;
    found.push(data.trim());
  }
  for (const each of document.body.querySelectorAll("[aria-label], [title], [placeholder]")) {
    if (!seen(each)) continue;
    for (const name of ["aria-label", "title", "placeholder"]) found.push(each.getAttribute(name) ?? "");
  }
  found.push(document.title);
  for (const model of Bokeh.documents.flatMap((each) => [...each._all_models.values()])) {
    const title = model.type === "Title" ? model.text : "";
    for (const text of [model.axis_label, model.html_attributes?.["aria-label"], title]) {
      if (typeof text === "string" && text) found.push(text);
    }
  }
  return found.filter(Boolean);
}"""
#: Names of what is given, which no language changes: units, numbers, names of records, units and treatments.
NUMBER = r"[−±+-]?[\d.,]+(?:e[−+]?\d+)?(?: ?(?:%|°|×|α|s|ms|µs|ns|ps|m|cm|g|rad|rad/s|m/s|m/s²|ft|in))?"
FREE = re.compile(
    rf"(?:{NUMBER}|[←→↑×?✓✗–∞…+-]|½|1/10+|m|cm|ft|in|°"
    r"|rad|g|s|m/s²|cm/s2|gal|mm/s2|mg|m/s2|[xyz]|−[xyz]|mm|km|α|rad/s|m/s|%|ms|µs|ns|ps)"
)


def marked(text):
    """A text with a sign at its front and at its back."""
    if isinstance(text, dict):
        return {form: marked(each) for form, each in text.items()}
    return f"⟦{text}⟧"


@pytest.fixture(scope="module")
def browser():
    with launched() as started:
        yield started


@pytest.fixture
def opened(browser):
    """Open the page of a server with a query in a locale."""
    contexts, servers = [], []

    def open_page(query="", locale="en-US", allowed=()):
        if not servers:
            servers.append(start_listening(Explorer(), {}))
            servers[0].run_in_background()
        contexts.append(browser.new_context(viewport={"width": 1280, "height": 900}, locale=locale))
        page = Watched(contexts[-1].new_page(), allowed)
        page.page.goto(servers[0].link(dict(parse_qsl(query))))
        page.until("document.body.dataset.ready && document.body.dataset.rested", "the page is ready")
        return page

    yield open_page
    for context in contexts:
        context.close()
    for server in servers:
        server.server.should_exit = True


def unmarked(page, known):
    """Texts that are shown without a mark, and how many were judged."""
    shown = page.js(SHOWN)
    wrong = []
    for text in shown:
        rest = text
        while (less := re.sub(r"⟦[^⟦⟧]*⟧", "", rest)) != rest:
            rest = less
        for name in known:
            rest = rest.replace(name, "")
        if rest.strip(" ;:,.()") and not all(
            FREE.fullmatch(each.strip(" ;:,.()")) for each in rest.split() if each.strip(" ;:,.()")
        ):
            wrong.append(text)
    return wrong, len(shown)


READY = {
    "map": "document.body.dataset.map === 'complete'",
    "periodic": "document.body.dataset.sweep === 'complete'",
    "compare": "document.body.dataset.compared > 0",
    "records": "document.body.dataset.listed > 0",
    "assessment": "document.body.dataset.assessment === 'complete'",
}


def test_every_text_of_every_view_is_that_of_the_file(opened, monkeypatch):
    files = page_files()
    texts = {key: marked(text) for key, text in json.loads(files["texts.json"]).items() if key}
    examples = json.loads(files["examples.json"])
    for each in examples:
        each |= {name: marked(each[name]) for name in ("title", "about", "source") if name in each}
        for step in each["steps"]:
            step["words"] = marked(step["words"])
    files |= {"texts.json": json.dumps(texts).encode(), "examples.json": json.dumps(examples).encode()}
    monkeypatch.setattr("rocking.explorer.server.page_files", lambda: files)
    records = [rocking.records.info(name) for name in rocking.records.names()]
    known = [part for each in records for part in (each.title, each.event, each.station, each.name)]
    known += [each.rpartition(", ")[0] for each in (record.title for record in records)]
    known += RULES.values()
    known.sort(key=len, reverse=True)
    judged, wrong = 0, {}
    for query, field in ((STATUE, "#pga"), (SINE + "&points=24&sweep_points=24&sweep_to=3", "#p")):
        page = opened(query, allowed=["422"])
        for view in ("response", "block", "map", "periodic", "compare", "records", "assessment", "examples"):
            if view == "examples":
                page.page.click("#to-examples")
                page.until("document.querySelectorAll('#examples-list li').length > 3")
            else:
                page.page.click(f"[data-view={view}]")
                page.until(
                    READY.get(view, "true") if query != STATUE or view in ("compare", "records") else "true", view
                )
            page.page.wait_for_timeout(300)
            found, count = unmarked(page, known)
            judged += count
            wrong |= dict.fromkeys(found, (view, field))
        page.page.click("[data-view=response]")
        page.page.fill(field, "-1")
        page.page.press(field, "Enter")
        page.until("!document.getElementById('problem').hidden", "the value is refused")
        assert re.match(r"“[^”]+” must be", page.text("#problem"))
        assert page.complaints == []
    assert not wrong, json.dumps(list(wrong.items())[:60], ensure_ascii=False)
    assert judged >= 1500


@pytest.mark.parametrize("locale", ["de-DE", "en-US"])
def test_numbers_are_those_of_the_locale_and_the_address_is_not(opened, locale):
    point, other = (",", ".") if locale == "de-DE" else (".", ",")
    page = opened(STATUE, locale)
    assert page.text("#figures div:first-child dd").startswith(f"0{point}265 α")
    assert f"α = 12{point}3°" in page.text("#derived")
    cells = page.page.locator("#sequences tbody tr:last-child td").all_text_contents()
    assert re.fullmatch(rf"\d+{re.escape(point)}\d{{9}}", cells[3])
    assert page.js(
        "Bokeh.documents.flatMap((each) => [...each._all_models.values()])"
        ".find((each) => each.type === 'BasicTickFormatter').doFormat([0, 0.5])"
    ) == ["0", f"0{point}5"]
    assert (
        page.js("import('/page/texts.js').then(({phrase}) => phrase('map.overturns_after', {count: 1234}))")
        == f"overturns after 1{other}234 impacts"
    )
    width = page.page.locator("#width")
    assert width.input_value() == "0.24" and "width=0.24" in page.text("#python")
    typed = {
        "0,3": "0.3",
        "1,5 m": "1.5 m",
        "1.5": "1.5",
        "0,250": "0.250",
        "1.234,5": "1234.5",
        "1,2,3": "1,2,3",
        "abc": "abc",
        "−2,5e-3": "-2.5e-3",
    }
    typed["1,234"] = "1.234" if locale == "de-DE" else "1234"
    found = {
        text: page.js("(text) => import('/page/numbers.js').then(({typed}) => typed(text))", text) for text in typed
    }
    assert found == typed
    page.rested(lambda: (width.fill("0,3"), width.press("Enter")))
    assert width.input_value() == "0.3" and f"α = 15{point}3°" in page.text("#derived")
    page.page.wait_for_timeout(250)
    again = opened(urlencode(parse_qsl(page.page.url.partition("?")[2])), "en-US" if locale == "de-DE" else "de-DE")
    assert again.page.url.partition("?")[2] == page.page.url.partition("?")[2] and "width=0.3&" in again.page.url
    assert again.page.locator("#width").input_value() == "0.3" and f"α = 15{other}3°" in again.text("#derived")
    assert page.complaints == again.complaints == []
