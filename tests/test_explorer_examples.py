"""The guided examples of the explorer's page: every number and claim of every sentence, against the package's own."""

import json
import math
import re
from pathlib import Path
from urllib.parse import parse_qsl

import numpy as np
import pytest

import rocking
from rocking.chattering import critical_amplitude
from rocking.explorer.core import Explorer
from rocking.explorer.parameters import PARAMETERS, list_names

EXAMPLES = json.loads((Path(rocking.__file__).parent / "explorer" / "page" / "examples.json").read_text("utf-8"))
STEPS = {(example["name"], k + 1): step for example in EXAMPLES for k, step in enumerate(example["steps"])}
G = 9.80665


class Shown:
    """What a step opens, computed by the page's core."""

    def __init__(self, explorer, query):
        given = dict(parse_qsl(query, strict_parsing=True))
        case = PARAMETERS.keys()
        self.texts = {name: given.pop(name) for name in case if name in given}
        self.given = given
        known = {"view", "from", "to", "at", "compare", *(f"other.{name}" for name in case)}
        assert given.keys() <= known and given.get("view", "response") in ("response", "block", "compare")
        self.header = explorer.case(self.texts).header
        self.response = explorer.simulate(self.texts).response
        self.start = self.end = math.nan
        if "from" in given:
            self.start, self.end = float(given["from"]), float(given["to"])
            self.window = explorer.window(self.texts, (self.start, self.end)).header["window"]
            times = explorer.simulate(self.texts).select_response(self.start, self.end).impacts["time"]
            self.impacts = times[(times > self.start) & (times < self.end)]
        if given.get("view") == "compare":
            other = {name[6:]: text for name, text in given.items() if name.startswith("other.")}
            self.other = explorer.compare(self.texts, other).header["cases"][1]
            kept = {} if "motion" in other else {n: t for n, t in self.texts.items() if n in list_names("motion")}
            block = {name: text for name, text in self.texts.items() if name not in list_names("motion")}
            self.second = explorer.simulate(block | kept | other).response

    @property
    def size(self):
        block = self.response.block
        return [f"{2 * block.half_width:.2g}", f"{2 * block.half_height:.2g}"]

    @property
    def lifts(self):
        return [f"{each:.3f}" for each in self.header["block"]["thresholds_g"]]

    @property
    def pga(self):
        return f"{self.response.motion.pga / G:.4g}"

    @property
    def peak(self):
        return percent(self.header)

    @property
    def rests(self):
        assert self.header["proven"] == self.header["rests"] > 0
        return str(self.header["rests"])

    @property
    def fall(self):
        return falls(self.header)

    def events(self, kind):
        return self.response.events[self.response.events["kind"] == kind]


def percent(header):
    assert not header["overturned"]
    return f"{100 * header['peak_over_slenderness']:.2g}"


def falls(header):
    assert header["overturned"]
    return f"{header['overturn_time']:.2f}"


def side_of_fall(response):
    return np.sign(response.rotation(response.duration))


def statue_stands(shown):
    assert shown.response.motion.name.startswith("ridgecrest") and shown.lifts[0] == shown.lifts[1]
    return [*shown.size, shown.pga, shown.lifts[0], shown.peak, shown.rests]


def statue_at_its_peak(shown):
    assert shown.start < shown.header["peak_time"] < shown.end
    assert float(shown.given["at"]) == pytest.approx(shown.header["peak_time"], abs=1e-3)
    return [f"{shown.header['peak_time']:.2f}", f"{math.degrees(abs(shown.header['peak_rotation'])):.1f}"]


def more_is_less(shown):
    weaker = Shown(Explorer(), STEPS["statue", 1]["query"])
    assert shown.header["peak_over_slenderness"] < weaker.header["peak_over_slenderness"]
    return [shown.pga, shown.peak, weaker.peak]


def statue_falls(shown):
    assert shown.response.tipping_time < shown.header["overturn_time"]
    return [shown.pga, shown.fall]


def small_block(shown):
    assert shown.texts["motion"].startswith("one-sine:")
    return [*shown.size, shown.pga, frequency(shown), shown.lifts[0], shown.fall]


def large_block(shown):
    small = Shown(Explorer(), STEPS["tank", 1]["query"])
    assert shown.texts["motion"] == small.texts["motion"] and shown.lifts == small.lifts
    ratios = shown.response.block.half_width / small.response.block.half_width
    assert shown.response.block.half_height / small.response.block.half_height == pytest.approx(ratios)
    return [f"{ratios:.4g}", *shown.size, shown.lifts[0], shown.peak]


def long_pulse(shown):
    before = Shown(Explorer(), STEPS["tank", 2]["query"])
    assert before.size == shown.size and before.pga == shown.pga
    return [shown.pga, frequency(shown), shown.fall]


def frequency(shown):
    return re.search(r"frequency=([\d.]+)", shown.texts["motion"])[1]


def times_lifting(shown, digits):
    assert float(frequency(shown)) * 2 * math.pi == pytest.approx(2.0 * shown.response.block.p)
    assert shown.response.block.alpha == 0.2 and shown.header["model"] == "linear"
    return f"{shown.response.motion.pga / (0.2 * G):.{digits}f}"


def complete(shown):
    uplifts = shown.events("uplift")
    assert len(uplifts) == 5 and list(uplifts["side"]) == [-1, 1, -1, 1, -1]
    return [times_lifting(shown, 2), f"{shown.events('rest')['time'][0]:.3f}", shown.rests]


def accumulation(shown):
    assert shown.start < shown.events("rest")["time"][0] < shown.end
    intervals = np.diff(shown.impacts)
    assert intervals[2:40] / intervals[:38] == pytest.approx(shown.header["eta_squared"], abs=1e-3)
    return [
        f"{1e6 * (shown.end - shown.start):.2g}",
        str(shown.window["impacts"]),
        f"{shown.header['eta_squared']:.4f}",
    ]


def just_below(shown):
    rest, lift = shown.events("rest")["time"][0], shown.events("uplift")["time"][1]
    critical = float(critical_amplitude(2.0, 0.92))
    assert rest < lift and float(times_lifting(shown, 6)) < critical < 1.0381
    return [times_lifting(shown, 3), f"{rest:.3f}", f"{1e3 * (lift - rest):.0f}", f"{critical:.5f}"]


def just_above(shown):
    assert float(times_lifting(shown, 6)) > float(critical_amplitude(2.0, 0.92))
    (rest,), end = shown.events("rest")["time"], shown.response.motion.duration
    assert end < rest and len(shown.events("uplift")) == 1
    return [times_lifting(shown, 4), f"{rest:.2f}", f"{end:.2f}"]


def falls_after_rests(shown):
    return [shown.pga, shown.rests, shown.fall]


def last_rest(shown):
    start, end = shown.response.rest_intervals[-1]
    assert shown.start < start < end < shown.end
    assert start == shown.events("rest")["time"][-1] and end == shown.events("uplift")["time"][-1]
    return [f"{start:.4f}", f"{1e3 * (end - start):.1f}"]


def rocks_on(shown):
    lifted, tipped = shown.events("uplift")["time"][-1], shown.response.tipping_time
    assert shown.start < shown.events("rest")["time"][-1] < lifted < tipped < shown.end
    return [f"{tipped - lifted:.1f}", f"{tipped:.2f}"]


def stays_up(shown):
    return [shown.pga, shown.rests, shown.peak]


def threshold(shown):
    text = shown.given["other.chattering"]
    assert text.startswith("velocity=") and shown.given["compare"] == "treatment"
    return text[9:]


def wrong_verdict(shown):
    assert not shown.header["overturned"] and shown.other["proven"] == 0
    return [threshold(shown), str(shown.other["rests"]), falls(shown.other)]


def wrong_peak(shown):
    assert shown.other["proven"] == 0
    return [shown.pga, threshold(shown), str(shown.other["rests"]), percent(shown.other), shown.rests, shown.peak]


def lifts_to_one_side(shown):
    first = shown.events("uplift")[0]
    half = 0.5 / float(frequency(shown))
    assert first["side"] == 1 and half < first["time"] < 2 * half
    right, left = shown.lifts
    assert float(right) < float(shown.pga) < float(left)
    return [shown.texts["offset"], right, left, shown.pga, f"{first['time']:.2f}"]


def sign_counts(shown):
    assert shown.given["other.motion"] == shown.texts["motion"].replace("=", "=-", 1)
    assert side_of_fall(shown.second) == 1 and shown.second.overturned
    return [shown.pga, shown.peak, falls(shown.other)]


def falls_to_the_left(shown):
    assert side_of_fall(shown.response) == -1 and set(shown.events("uplift")["side"]) == {1}
    return [shown.pga, shown.fall]


#: For each step what returns its numbers, as its sentence has them one after the other, and checks what else it claims.
CLAIMS = {
    ("statue", 1): statue_stands,
    ("statue", 2): statue_at_its_peak,
    ("statue", 3): more_is_less,
    ("statue", 4): statue_falls,
    ("tank", 1): small_block,
    ("tank", 2): large_block,
    ("tank", 3): long_pulse,
    ("critical-sine", 1): complete,
    ("critical-sine", 2): accumulation,
    ("critical-sine", 3): just_below,
    ("critical-sine", 4): just_above,
    ("rest-and-fall", 1): falls_after_rests,
    ("rest-and-fall", 2): last_rest,
    ("rest-and-fall", 3): rocks_on,
    ("threshold", 1): stays_up,
    ("threshold", 2): wrong_verdict,
    ("threshold", 3): wrong_peak,
    ("two-sides", 1): lifts_to_one_side,
    ("two-sides", 2): sign_counts,
    ("two-sides", 3): falls_to_the_left,
}


@pytest.fixture(scope="module")
def explorer():
    return Explorer()


@pytest.mark.parametrize("step", CLAIMS, ids=lambda step: f"{step[0]}-{step[1]}")
def test_each_number_of_a_sentence_is_computed(explorer, step):
    shown = Shown(explorer, STEPS[step]["query"])
    assert re.findall(r"\d+(?:\.\d+)?", STEPS[step]["words"]) == CLAIMS[step](shown)


def test_each_step_is_short_and_checked():
    assert len(EXAMPLES) == 6 and STEPS.keys() == CLAIMS.keys()
    assert all(2 <= len(example["steps"]) <= 4 for example in EXAMPLES)
    sentences = [len(re.findall(r"[.:]( |$)", step["words"])) for step in STEPS.values()]
    assert max(sentences) <= 4 and min(sentences) >= 1
