"""Colours of the explorer's page: marks stand out against what is beside them, and orange means overturning."""

import colorsys
import re
from pathlib import Path

import pytest

import rocking.explorer
from rocking.explorer.payload import load_english_texts

PAGE = Path(rocking.explorer.__file__).parent / "page"
STYLE = (PAGE / "colours.css").read_text("utf-8")
OUTCOMES = (PAGE / "map.js").read_text("utf-8")
HEX = re.compile(r"#[0-9a-fA-F]{6}\b")

#: Marks, each with what is beside it; contrast is 3:1 at least (WCAG 2.2, 1.4.11).
MARKS = {
    "ink": "paper rest desk stone",
    "soft": "paper rest",
    "border": "paper desk",
    "accent": "paper desk",
    "over": "paper",
    "wrong": "paper desk",
    "second": "paper rest ink",
    "ground": "paper",
    "vertical": "paper",
    "edge": "paper rest",
    "earth": "paper rest",
    "focus": "paper desk",
    "paper": "accent",
}
#: Texts, each with what they are written on; contrast is 4.5:1 at least (1.4.3).
TEXTS = {"ink": "paper desk", "soft": "paper desk", "accent": "paper", "wrong": "paper desk", "paper": "accent soft"}


def palettes():
    """Colours of the light page and of the dark one."""
    rules = re.split(r":root(?:, :root\.lit)? \{", STYLE)[1:3]
    light, dark = (dict(re.findall(r"--([a-z]+): (#[0-9a-f]{6});", each)) for each in rules)
    return {"light": light, "dark": dark}


def channels(ink):
    return [int(ink[k : k + 2], 16) / 255 for k in (1, 3, 5)]


def luminance(ink):
    red, green, blue = (part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in channels(ink))
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def contrast(first, second):
    low, high = sorted((luminance(first), luminance(second)))
    return (high + 0.05) / (low + 0.05)


def is_orange(ink):
    hue, _, saturation = colorsys.rgb_to_hls(*channels(ink))
    return 15 <= 360 * hue <= 45 and saturation > 0.5


def constant(name):
    """Colours of a constant of map.js."""
    return HEX.findall(re.search(rf"export const {name} = .*?;\n", OUTCOMES, re.S)[0])


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize(("kind", "least"), [(MARKS, 3.0), (TEXTS, 4.5)], ids=["marks", "texts"])
def test_colours_of_the_page_stand_out(scheme, kind, least):
    colours = palettes()[scheme]
    pairs = [(mark, other) for mark, others in kind.items() for other in others.split()]
    faint = {pair: contrast(*(colours[name] for name in pair)) for pair in pairs}
    assert len(pairs) >= 9
    assert {pair: each for pair, each in faint.items() if each < least} == {}


def test_orange_means_overturning_and_nothing_else():
    for scheme, colours in palettes().items():
        assert [name for name, ink in colours.items() if is_orange(ink)] == ["over"], scheme
    modes = re.findall(r'\[(-?\d), "(#[0-9a-f]{6})"\]', OUTCOMES.partition("VERDICTS")[0])
    assert len(modes) >= 7
    for mode, ink in modes:
        text = load_english_texts()[f"mode.{mode}"]
        assert is_orange(ink) == text.startswith("overturns"), text
    assert [is_orange(ink) for ink in constant("OUTCOMES")] == [False] * 4 + [True, False]
    assert not any(map(is_orange, constant("RAMP")[:-1]))
