"""The texts of the explorer's page: each is used and there, and its places are what its caller gives."""

import json
import re
from pathlib import Path

import rocking
from rocking.explorer import payload
from rocking.explorer.parameters import ASSESSMENT_NAMES, MAP_NAMES, PARAMETERS, SWEEP_NAMES, describe_inputs

FOLDER = Path(rocking.__file__).parent / "explorer"
TEXTS = payload.load_english_texts()
#: Texts that the scripts look up by the name of a parameter, a pulse, and so on.
LOOKED_UP = r"(field|about|shape|pulse|quantity|model|treatment|scaled|outcome|mode|overturned|axis)\..+"


def test_every_text_is_used():
    used = {key for key in TEXTS if re.fullmatch(LOOKED_UP, key)}
    assert TEXTS.keys() == used and len(used) >= 100


def test_every_parameter_has_its_text_and_no_text_is_of_none():
    described = describe_inputs()
    fields = {each.text or each.name for each in PARAMETERS.values()} | {
        *MAP_NAMES,
        *SWEEP_NAMES,
        *ASSESSMENT_NAMES,
        "at",
    } - {"quantity"}
    fields |= {each["text"] for pulse in described["pulses"].values() for each in pulse["parameters"]}
    fields |= {described["period"]["text"]}
    fields |= {each["limit"]["text"] for each in described["treatments"] if "limit" in each}
    assert {f"field.{each}" for each in fields} == {key for key in TEXTS if key.startswith("field.")}
    about = {key.removeprefix("about.") for key in TEXTS if key.startswith("about.")}
    assert about <= fields and len(about) >= 20
    names = [f"shape.{each['name']}" for each in described["shapes"]]
    names += [f"pulse.{name}" for name in described["pulses"]]
    names += [f"quantity.{name}" for name in described["quantities"]]
    names += [f"model.{name}" for name in described["models"]]
    names += [f"treatment.{each['name']}" for each in described["treatments"]]
    names += [f"scaled.{name or 'none'}" for name in described["scalings"]]
    assert set(names) <= TEXTS.keys() and len(names) >= 25


def test_the_page_contains_all_texts_whatever_they_contain():
    page = payload.fill_page((FOLDER / "page" / "index.html").read_text("utf-8"), TEXTS | {"x": "</script><b>"})
    found = re.search(r'<script type="application/json" id="texts">(.*?)</script>', page, re.S)
    assert json.loads(found[1])["x"] == "</script><b>" and len(json.loads(found[1])) == len(TEXTS) + 1
