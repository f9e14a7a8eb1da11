"""The texts of the explorer's page: each is used and there, and its places are what its caller gives."""

import ast
import json
import re
from pathlib import Path

import pytest
from explorer_texts import in_english

import rocking
from rocking.explorer.parameters import ASSESSMENT, MAP, PARAMETERS, READING, SWEEP, specification
from rocking.explorer.payload import fill_page, load_english_texts

FOLDER = Path(rocking.__file__).parent / "explorer"
TEXTS = {key: text for key, text in load_english_texts().items() if key}
#: Texts that Python alone puts into messages, and those of parameters, which are looked up by the name of each.
OF_FIELDS = ("field.", "about.")


def forms(text):
    return list(text.values()) if isinstance(text, dict) else [text]


def places(text):
    return {name for form in forms(text) for name in re.findall(r"\{(\w+)", form)}


def split(code):
    """Parts of the code of a list at the commas that are in no bracket and in no text."""
    parts, depth, quote, start = [], 0, "", 0
    for k, letter in enumerate(code):
        if quote:
            quote = "" if letter == quote and code[k - 1] != "\\" else quote
        elif letter in "\"'`":
            quote = letter
        elif letter in "([{":
            depth += 1
        elif letter in ")]}":
            depth -= 1
            if depth < 0:
                return [*parts, code[start:k].strip()]
        elif letter == "," and depth == 0:
            parts.append(code[start:k].strip())
            start = k + 1
    return [*parts, code[start:].strip()]


def in_scripts():
    """Calls of the page's scripts: patterns of keys, and the names that are given; None where others hold them."""
    found = []
    for file in sorted((FOLDER / "page").glob("*.js")):
        code = re.sub(r"(?m)^\s*(//|/?\*).*$", "", file.read_text("utf-8"))
        for call in re.finditer(r"(?<![.\w])(?<!function )phrase\(", code):
            key, *values = [part for part in split(code[call.end() :]) if part]
            if file.name == "texts.js":
                continue
            keys = re.findall(r'"([a-z_]+\.[\w.-]+)"', key)
            keys = [re.escape(each) for each in keys] or [re.sub(r"\\?\$\\?\{.*?\\?\}", "[^ ]+", key.strip("`"))]
            names = None
            if not values:
                names = set()
            elif values[0].startswith("{") and "..." not in values[0]:
                names = {re.match(r"\w+", part)[0] for part in split(values[0][1:]) if part}
            found.append((file.name, keys, names))
    return found


def in_python():
    """Calls of the server's modules, in the same form."""
    found = []
    for file in sorted(FOLDER.glob("*.py")):
        for call in ast.walk(ast.parse(file.read_text("utf-8"))):
            if not (isinstance(call, ast.Call) and getattr(call.func, "id", "") == "phrase"):
                continue
            names = None if any(each.arg is None for each in call.keywords) else {each.arg for each in call.keywords}
            first = call.args[0]
            if isinstance(first, ast.JoinedStr):
                keys = [
                    "".join(
                        re.escape(part.value) if isinstance(part, ast.Constant) else "[^ ]+" for part in first.values
                    )
                ]
            elif isinstance(first, ast.Name):
                keys = [r"sweep\.(overturns|given_up)"]
            else:
                keys = [
                    re.escape(part.value)
                    for part in ast.walk(first)
                    if isinstance(part, ast.Constant) and isinstance(part.value, str)
                ]
            found.append((file.name, keys, names))
    return found


def test_every_text_is_used_and_every_one_that_is_used_is_there():
    page = (FOLDER / "page" / "index.html").read_text("utf-8")
    used = set(re.findall(r"\{([a-z]+\.[a-z_]+)\}", page))
    assert used <= TEXTS.keys() and len(used) >= 140
    judged = 0
    for file, keys, names in [*in_scripts(), *in_python()]:
        for pattern in keys:
            matches = re.compile(pattern).fullmatch
            matching = {key for key in TEXTS if matches(key)}
            assert matching, (file, pattern)
            used |= matching
            for key in matching if names is not None else ():
                given = names - ({"count"} if isinstance(TEXTS[key], dict) else set())
                assert given == places(TEXTS[key]) - ({"count"} if isinstance(TEXTS[key], dict) else set()), (file, key)
                judged += 1
    assert judged >= 350
    unused = {key for key in TEXTS if not key.startswith(OF_FIELDS)} - used
    assert unused == set()


def test_every_parameter_has_its_text_and_no_text_is_of_none():
    described = specification()
    all_ = [each for group in (PARAMETERS, MAP, SWEEP, READING, ASSESSMENT) for each in group.values()]
    fields = {each.text or each.name for each in all_}
    fields |= {each["text"] for pulse in described["pulses"].values() for each in pulse["parameters"]}
    fields |= {
        described["period"]["text"],
        *(each["limit"]["text"] for each in described["treatments"] if "limit" in each),
    }
    assert {f"field.{each}" for each in fields} == {key for key in TEXTS if key.startswith("field.")}
    about = {key.removeprefix("about.") for key in TEXTS if key.startswith("about.")}
    assert about <= fields and len(about) >= 20
    names = [f"shape.{each['name']}" for each in described["shapes"]] + [
        f"pulse.{name}" for name in described["pulses"]
    ]
    names += [f"quantity.{name}" for name in described["quantities"]] + [
        f"model.{name}" for name in described["models"]
    ]
    names += [f"treatment.{each['name']}" for each in described["treatments"]]
    names += [f"scaled.{name or 'none'}" for name in described["scalings"]]
    assert set(names) <= TEXTS.keys() and len(names) >= 25


@pytest.mark.parametrize(
    ("count", "expected"), [(1, "comes to rest once"), (2, "comes to rest twice"), (7, "comes to rest 7 times")]
)
def test_a_count_chooses_its_form(count, expected):
    assert in_english({"phrase": "verdict.rests", "values": {"count": count}}) == expected


def test_the_page_comes_filled_in_with_every_text_and_no_place_is_left():
    page = fill_page((FOLDER / "page" / "index.html").read_text("utf-8"), TEXTS | {"save.copy": "</script><b>"})
    found = re.search(r'<script type="application/json" id="texts">(.*?)</script>', page, re.S)
    assert json.loads(found[1])["save.copy"] == "</script><b>" and len(json.loads(found[1])) == len(TEXTS)
    rest = page.replace(found[0], "")
    assert not re.search(r"\{[a-z]+\.|TEXTS", rest) and "&lt;/script&gt;&lt;b&gt;" in rest
