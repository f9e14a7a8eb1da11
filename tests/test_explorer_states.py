"""States of the page drawn at random: what it shows is what the command that it hands out prints, to the last digit."""

import json
import random
import shlex

import explorer_addresses
import pytest
from explorer_answers import page_answer

from rocking.explorer.core import Explorer

#: Numbers of the page, and what the command's result calls them.
NUMBERS = {
    "peak_rotation": "peak_rotation_rad",
    "peak_over_slenderness": "peak_over_slenderness",
    "peak_time": "peak_time_s",
    "overturned": "overturned",
    "overturn_time": "overturn_time_s",
    "duration": "duration_s",
    "impacts": "impacts_resolved",
}


@pytest.fixture(scope="module")
def explorer():
    return Explorer()


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("seed", "count"), [(25, 10), pytest.param(26, 60, marks=pytest.mark.slow)], ids=["ten states", "many states"]
)
def test_random_states_are_what_their_commands_print(explorer, run, seed, count):
    draw, judged, fates = random.Random(seed), 0, set()
    for _ in range(count):
        texts = explorer_addresses.sound(draw)
        header = page_answer(explorer, "case", texts).header
        words = shlex.split(page_answer(explorer, "details", texts).header["command"])
        code, out, err = run(*words[1:], "--json", "--quiet")
        assert (words[0], code, err) == ("rocking", 0, ""), texts
        result = json.loads(out)
        # JSON has no number for what is not finite: it is none in a result, and a header is sent so, too.
        shown = json.loads(json.dumps({name: _finite(header[name]) for name in NUMBERS}))
        # The page rounds this number to the digits that are known, where these are fewer than it shows.
        ratio = result["peak_over_slenderness"]
        rounded = [ratio if ratio is None else float(f"{ratio:.{digits}g}") for digits in (1, 2, 3)]
        assert shown.pop("peak_over_slenderness") in [ratio, *rounded], texts
        assert shown == {name: result[called] for name, called in NUMBERS.items() if name in shown}, texts
        assert header["rests"] == sum(each["kind"] == "rest" for each in result["events"]), texts
        fates.add((header["overturned"], header["rests"] > 0, header["impacts"] > 0))
        judged += 1
    assert judged == count >= 10 and len(fates) >= 3


def _finite(value):
    return None if isinstance(value, float) and not abs(value) < float("inf") else value
