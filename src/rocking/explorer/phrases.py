"""The texts of the page by their keys, one file for each language: the server sends keys, the page has words.

`page/texts.json` has the English texts; a file ``texts.de.json`` beside it, and ``examples.de.json``, would be German.
"""

from __future__ import annotations

import functools
import json
import re
from collections.abc import Mapping
from html import escape
from importlib import resources
from typing import Any, Final

#: The language of the texts that are always there.
ENGLISH: Final = "en"

#: Places of the page that are filled in with a text.
_PLACE: Final = re.compile(r"\{([a-z]+\.[a-z_]+)\}")


def phrase(key: str, **values: Any) -> dict[str, Any]:
    """Return something that the page says: the key of a text, and what is put at its places.

    Examples
    --------
    >>> phrase("verdict.overturns", time=1.5)
    {'phrase': 'verdict.overturns', 'values': {'time': 1.5}}
    """
    return {"phrase": key, "values": values}


def file_name(name: str, language: str) -> str:
    """Return what a file of the page is called in a language.

    Examples
    --------
    >>> file_name("texts.json", "en"), file_name("texts.json", "de")
    ('texts.json', 'texts.de.json')
    """
    return name if language == ENGLISH else name.replace(".", f".{language}.", 1)


def preferred(accepted: str, files: Mapping[str, bytes]) -> str:
    """Return the first language of a browser's header ``Accept-Language`` of which there is a file.

    Examples
    --------
    >>> preferred("fr, de-CH;q=0.8, en;q=0.9", {"texts.json": b"", "texts.de.json": b""})
    'en'
    >>> preferred("fr, de-CH;q=0.8, en;q=0.7", {"texts.json": b"", "texts.de.json": b""})
    'de'
    """
    wanted: list[tuple[float, str]] = []
    for part in accepted.split(","):
        name, _, weight = part.strip().partition(";q=")
        try:
            wanted.append((-float(weight or 1.0), name.split("-")[0].lower()))
        except ValueError:
            continue
    for _, language in sorted(wanted, key=lambda each: each[0]):
        if language.isalpha() and file_name("texts.json", language) in files:
            return language
    return ENGLISH


def filled(page: str, language: str, texts: Mapping[str, Any]) -> str:
    """Return the page in a language: each ``{key}`` is its text, and all texts stand in it for its scripts.

    Examples
    --------
    >>> filled('<html lang="LANGUAGE"><b title="{save.copy}">{save.copy}</b>TEXTS', "en", {"save.copy": "Copy"})
    '<html lang="en"><b title="Copy">Copy</b>{"save.copy": "Copy"}'
    """
    said = json.dumps({key: text for key, text in texts.items() if key}, ensure_ascii=False).replace("<", "\\u003c")
    page = _PLACE.sub(lambda place: escape(texts[place[1]]), page)
    return page.replace("LANGUAGE", language, 1).replace("TEXTS", said, 1)


@functools.cache
def english() -> dict[str, Any]:
    """Return the English texts by their keys; one that has several forms is a dictionary of them."""
    file = resources.files("rocking.explorer") / "page" / "texts.json"
    found: dict[str, Any] = json.loads(file.read_text("utf-8"))
    return found
