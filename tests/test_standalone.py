"""The standalone page: its kernels against the package, its file, and what people do with it, in a browser."""

import numpy as np
import pytest
from explorer_browser import Watched, launched

import rocking
from rocking import pulses
from rocking.explorer import standalone
from rocking.kernels import library
from rocking.simulation.simulate import compute_response

CASES = 1000
KINDS = (*standalone.PULSES, "sine", "tilt", *standalone.RECORDS)

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
def html():
    if not library.read_manifest()["page"]:
        pytest.skip("the kernels were built without ziglang")
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
    initial = (case["tilt"] * change, 0.0)
    if case["tilt"]:
        return compute_response(block, None, case["model"], "certified", None, initial)
    if kind in standalone.RECORDS:
        motion = rocking.records.load(kind)
        amplitude /= motion.pga
    elif kind == "sine":
        motion = pulses.sine(1.0, rate, cycles=case["cycles"])
    else:
        motion = getattr(pulses, kind.replace("-", "_"))(1.0, rate)
    return compute_response(block, motion, case["model"], "certified", None, initial, factor=amplitude)


def outcome_of(response):
    """Counts, end, peak and times of the events of a response, as `OUTCOMES` returns them."""
    kinds = response.events["kind"].tolist()
    counts = [len(response.impacts), kinds.count("uplift"), kinds.count("rest")]
    return [*counts, response.duration, abs(response.peak_rotation), *response.events["time"]]


def is_equal(first, second):
    """Whether counts are equal, and times within 1e-11 s."""
    return (
        len(first) == len(second)
        and first[:3] == second[:3]
        and np.allclose(first[3:], second[3:], rtol=0.0, atol=1e-11)
    )


@pytest.mark.browser
def test_outcomes_are_those_of_the_package(opened):
    rng = np.random.default_rng(20261129)
    cases = [draw_case(rng, kind) for kind in np.resize(KINDS, CASES).tolist()]
    computed = opened().js(OUTCOMES, cases)
    fallen, sensitive = 0, []
    for case, (overturned, *outcome) in zip(cases, computed, strict=True):
        response = simulate_case(case)
        assert bool(overturned) == response.overturned, case
        fallen += overturned
        if not is_equal(outcome, outcome_of(response)):  # then the package itself differs as much after a last bit
            sensitive.append(case["motion"])
            neighbours = [simulate_case(case, 1.0 + k * 2.0**-52) for k in (-2, -1, 1, 2)]
            assert not all(is_equal(outcome_of(each), outcome_of(response)) for each in neighbours), case
    assert 0.2 * CASES < fallen < 0.8 * CASES
    assert set(sensitive) <= {"ridgecrest-clc-090"} and len(sensitive) <= 0.02 * CASES
