"""What the explorer's page makes of the keys and values that the server sends: English, in Python, for tests."""

import re

from rocking.explorer.phrases import english


def in_english(said):
    """A sentence as the page writes it in English."""
    if isinstance(said, str):
        return said
    values = said["values"]
    form = english()[said["phrase"]]
    if isinstance(form, dict):
        count = values["count"]
        form = form.get(str(count)) or form.get("one" if count == 1 else "other") or form["other"]

    def written(place):
        name, digits, kind = place.groups()
        value = values[name]
        if not isinstance(value, int | float):
            return in_english(value)
        return f"{value:.{digits or 6}{kind}}" if kind else f"{value:.0f}"

    return re.sub(r"\{(\w+)(?::\.?(\d*)([fg]))?\}", written, form)
