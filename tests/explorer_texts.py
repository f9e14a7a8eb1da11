"""What the explorer's page makes of the keys and values that the server sends: English, in Python, for tests."""

import math
import re

from rocking.explorer.core import Query
from rocking.explorer.payload import load_english_texts

#: Kinds of quantities in texts: the unit in which the page shows them unless another is chosen, in SI units.
MEASURES = {"angle": (math.radians(1.0), "°"), "acceleration": (9.80665, " g"), "length": (1.0, " m")}


def in_english(said):
    """A sentence as the page writes it in English."""
    if isinstance(said, str):
        return said
    values = said["values"]
    form = load_english_texts()[said["phrase"]]

    def written(place):
        name, digits, kind = place.groups()
        value = values[name]
        if not isinstance(value, int | float):
            return in_english(value)
        if kind in MEASURES:
            size, unit = MEASURES[kind]
            return f"{value / size:.{digits or 3}g}{unit}"
        return f"{value:.{digits or 6}{kind}}" if kind else f"{value:.0f}"

    return re.sub(r"\{(\w+)(?::\.?(\d*)([a-z]+))?\}", written, form)


def page_answer(explorer, name, texts, window=None, **others):
    """Answer of an explorer to a request of the page on a case, in a window (s)."""
    ends = {} if window is None else {"from": repr(window[0]), "to": repr(window[1])}
    return explorer.answer(name, Query({**texts, **ends, **others}))
