"""What is read from a case: phase plane and energy, an instant, a thumbnail; against the response itself."""

import numpy as np
import pytest
from explorer_texts import in_english

import rocking
from rocking.errors import OptionError
from rocking.explorer import maps, readings
from rocking.explorer.core import Explorer
from rocking.explorer.inputs import read_case

STATUE = {"width": "0.24", "height": "1.1", "motion": "ridgecrest-clc-090", "pga": "0.4g"}
SIDES = {"width": "0.24", "height": "1.1", "offset": "0.03", "motion": "sine:amplitude=0.2g,frequency=2,cycles=2.5"}


@pytest.fixture(scope="module")
def explorer():
    return Explorer()


def statue():
    motion = rocking.records.load("ridgecrest-clc-090").scaled_to(0.4 * 9.80665, "pga")
    return rocking.simulate(rocking.Block(width=0.24, height=1.1), motion)


@pytest.mark.parametrize("texts", [STATUE, SIDES, {**SIDES, "model": "linear"}])
def test_the_phase_plane_and_the_energy_are_the_responses_own(explorer, texts):
    response = explorer.simulate(texts).response
    start, end = (230.5, 233.5) if texts is STATUE else (0.2, 2.0)
    header, arrays = (found := readings.sample_phase(explorer, texts, (start, end))).header, found.arrays
    times = start + arrays["time"]
    before = arrays["before"].astype(int)
    impacts = response.impacts[(response.impacts["time"] >= start) & (response.impacts["time"] <= end)]
    assert len(before) == len(impacts) >= 2
    smooth = np.delete(np.arange(len(times)), np.union1d(before, before + 1))
    assert len(smooth) > 2000
    # A time that is added to the start again may be off by its last digit.
    slack = 4e-14 * max(1.0, end)
    for name, ask in (("kinetic", response.kinetic_energy), ("potential", response.potential_energy)):
        np.testing.assert_allclose(arrays[name][smooth], ask(times[smooth]), rtol=1e-9, atol=200 * slack)
    drops = [arrays["kinetic"][k] - arrays["kinetic"][k + 1] for k in before]
    np.testing.assert_allclose(drops, response.impact_losses[np.isin(response.impacts["time"], impacts["time"])])
    assert min(header["needed"]) == 1.0
    assert (max(header["needed"]) > 1.5) == (texts is not STATUE)
    assert len(arrays["uplift"]) == np.sum(
        (response.events["kind"] == "uplift") & (response.events["time"] >= start) & (response.events["time"] <= end)
    )


def test_an_instant_is_read_from_the_series(explorer):
    response, judged = statue(), 0
    for time in (230.0, 232.123456789, 233.25, float(response.impacts["time"][100])):
        found = readings.find_state(explorer, STATUE, repr(time), (229.0, 236.0))
        assert (found["rotation"], found["velocity"], found["acceleration"]) == tuple(response.states(time))
        assert found["ground_g"] == pytest.approx(float(response.motion.acceleration(time)) / 9.80665, rel=1e-14)
        assert found["energy"] == response.kinetic_energy(time) + response.potential_energy(time)
        resting = any(start <= time < end for start, end in response.rest_intervals)
        words = "leans to the right" if found["rotation"] > 0.0 else "leans to the left"
        expected = "is at rest" if resting else words if found["rotation"] else "stands on both corners"
        assert in_english(found["state"]) == expected
        judged += 1
    assert judged == 4
    assert readings.find_state(explorer, STATUE, "232123.456789 ms")["time"] == pytest.approx(232.123456789, rel=1e-15)


def test_an_instant_outside_the_response_is_refused_by_the_name_of_its_field(explorer):
    for text, words in (
        ("-1", "from 0 to"),
        ("9999 s", "not 9999 s"),
        ("soon", "a time, as 1.5"),
        ("", "a time, as 1.5"),
    ):
        with pytest.raises(OptionError, match=words) as refused:
            readings.find_state(explorer, STATUE, text)
        assert refused.value.argument == "at"


def test_a_thumbnail_says_what_the_opened_case_says(explorer):
    axes = {"x": "omega", "y": "a", "points": "8", "y_to": "3"}
    grid = maps.read_grid(read_case({**SIDES, "offset": "0"}, explorer.uploads), axes)
    for x, y in ((1.0, 1.02), (2.0, 2.9)):
        texts = maps.map_point_to_texts(grid, x, y)
        found, whole = readings.create_thumbnail(explorer, texts), explorer.case(texts)
        assert found.header["verdict"] == whole.header["verdict"]
        assert len(found.arrays["time"]) <= 300
        assert np.abs(found.arrays["rotation"]).max() == pytest.approx(
            min(whole.header["peak_over_slenderness"], 0.5 * np.pi / whole.header["block"]["sides"][0]["alpha"]),
            rel=0.02,
        )
