"""What every public result says of itself at the prompt: a line or two, no arrays, numbers with their units."""

import contextlib
import copy
import functools
import pickle
from collections.abc import Iterator
from types import MappingProxyType

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import rocking
from rocking import records
from rocking.analysis.survey import survey
from rocking.kernels.trace import Trail

BLOCK = rocking.Block(width=0.24, height=1.1)
RECORD = rocking.records.load("el-centro-meloland-270")
MOTIONS = [rocking.pulses.one_sine(a, f) for a in np.linspace(2.0, 9.0, 5) for f in (0.6, 1.0, 1.6)]
WALL = rocking.Block.one_sided(width=0.5, height=4.0, restitution=0.4)
COLUMN = rocking.RestrainedBlock(
    rocking.Block(width=0.4, height=2.0, mass=2000.0), rocking.Tendon(2e5, prestress=2e3, strength=2e4)
)
SOLID = rocking.Solid(
    [(0.3, 0.2), (-0.3, 0.2), (-0.3, -0.2), (0.3, -0.2)], (0.0, 0.0, 0.9), np.diag([3.4, 3.6, 0.52]) / 12
)
SITE = rocking.HazardCurve([0.5, 1.0, 2.0], [0.1, 0.01, 0.001])

#: Longer than any sentence at the prompt.
LONGEST = 420

#: What belongs to others: arrays, tables and figures; and a kernel's own records.
OTHERS = (np.ndarray, np.generic, pd.DataFrame, xr.Dataset, xr.DataArray, Trail)


@pytest.fixture(scope="module")
def table(tmp_path_factory):
    path = tmp_path_factory.mktemp("records") / "mine.csv"
    path.write_text("time (s),a (g)\n" + "".join(f"{0.01 * k:.2f},{0.1 * (k % 7 - 3):.3f}\n" for k in range(400)))
    return path


RESULTS = {
    "block": lambda path: BLOCK,
    "two-sided block": lambda path: rocking.Block.from_pivots((0.2, 0.15), 0.6, 0.4),
    "blocks": lambda path: rocking.Blocks.grid(p=[1.0, 2.0], alpha=[0.1, 0.2]),
    "motion": lambda path: RECORD.scaled_to(5.0).with_vertical(RECORD),
    "wall": lambda path: WALL,
    "column with a tendon": lambda path: COLUMN,
    "restrained blocks": lambda path: COLUMN.as_bodies(),
    "response": lambda path: rocking.simulate(BLOCK, RECORD),
    "response of a wall": lambda path: rocking.simulate(WALL, RECORD),
    "gradient": lambda path: rocking.gradient(rocking.simulate(WALL, RECORD)),
    "critical scale": lambda path: rocking.critical_scale(WALL, MOTIONS[0], (0.5, 20.0)),
    "map": lambda path: rocking.dynamics.stroboscopic_map(BLOCK, MOTIONS[0]),
    "solid": lambda path: SOLID,
    "rose": lambda path: SOLID.rose(),
    "fragility": lambda path: rocking.fit_fragility([2.0, 3.0, 4.0, 5.0], [1, 4, 7, 10], trial_counts=10),
    "risk": lambda path: rocking.fit_fragility([2.0, 3.0, 4.0], [1, 4, 7], trial_counts=10).annual_rate(SITE),
    "survey": lambda path: survey(BLOCK, {"one": RECORD, "two": -RECORD}),
    "rule": lambda path: rocking.rules.west([BLOCK, rocking.Block(half_width=0.2, half_height=1.0)], RECORD),
    "check": lambda path: rocking.rules.compare_rules(BLOCK, {"one": RECORD}, rules=["west"]),
    "channel": lambda path: records.channels(path)[0],
    "format": lambda path: records.identify(path),
    "chattering": lambda path: rocking.chattering.chattering_report(1.03, 2.0, 0.92),
    "critical amplitude": lambda path: rocking.chattering.critical_report(2.0, 0.92),
    "episodes": lambda path: rocking.chattering.chattering_episodes(rocking.simulate(BLOCK, RECORD)),
    "treatment": lambda path: rocking.Certified(),
    "calibration": lambda path: calibrated(),
    "calibrated history": lambda path: calibrated_history(),
    "validation": lambda path: validated(),
}


# What a calibration says does not hang on how well the block is known, and no test here changes a result.
@functools.cache
def calibrated():
    overturned = [rocking.simulate(BLOCK, one, model="linear").overturned for one in MOTIONS]
    return rocking.calibrate(MOTIONS, overturned, model="linear", candidate_count=128, p=3.0, two_sided=False)


@functools.cache
def validated():
    return calibrated().cross_validate(fold_count=2)


@functools.cache
def calibrated_history():
    times = np.linspace(0.0, 3.0, 301)
    response = rocking.simulate(
        rocking.Block.from_parameters(p=3.0, alpha=0.2), None, initial_rotation=0.1, duration=4.0
    )
    return rocking.calibrate_history(times, response.rotation(times), alpha=0.2)


def parts_of(value: object, name: str, seen: set[int]) -> Iterator[tuple[str, object]]:
    """Every object of the package's own that public attributes, mappings and tuples lead to."""
    if isinstance(value, (tuple, list, dict, MappingProxyType)) and type(value).__module__ == "builtins":
        entries = value.items() if hasattr(value, "items") else enumerate(value)
        for key, entry in list(entries)[:3]:
            yield from parts_of(entry, f"{name}[{key}]", seen)
    if isinstance(value, OTHERS) or not type(value).__module__.startswith("rocking") or id(value) in seen:
        return
    seen.add(id(value))
    yield name, value
    for each in [*vars(type(value)), *getattr(value, "__dict__", {})]:
        with contextlib.suppress(AttributeError, rocking.errors.OptionError):  # of what this one lacks
            if not each.startswith("_") and not callable(part := getattr(value, each)):
                yield from parts_of(part, f"{name}.{each}", seen)


@pytest.fixture(autouse=True)
def _coarse(coarse):
    """Fewer candidates and draws for all that is calibrated here."""


@pytest.mark.parametrize("result", RESULTS)
def test_what_is_shown_at_the_prompt_is_a_sentence_without_arrays(result, table):
    found = list(parts_of(RESULTS[result](table), result, set()))
    assert found
    for name, value in found:
        shown = repr(value)
        assert len(shown) <= LONGEST, f"{name}: {len(shown)} characters: {shown[:200]}"
        assert "array(" not in shown, f"{name}: {shown}"
        assert "np.float" not in shown, f"{name}: {shown}"


@pytest.mark.parametrize("result", RESULTS)
def test_a_result_can_be_kept_in_a_file_and_sent_to_another_process(result, table):
    found = RESULTS[result](table)
    again = pickle.loads(pickle.dumps(found))
    assert type(again) is type(found)
    assert repr(again) == repr(found) == repr(copy.deepcopy(found))


def test_a_number_is_answered_with_a_number():
    response = rocking.simulate(BLOCK, RECORD)
    fitted = rocking.fit_fragility([2.0, 3.0, 4.0], [1, 4, 7], trial_counts=10).curves[0]
    asked = [getattr(response, name) for name in ("rotation", "angular_velocity", "normal_force", "friction_demand")]
    asked += [
        fitted.probability,
        SITE.rate_of,
        lambda x: fitted.largest_rate(x, years=100.0),
        lambda x: fitted.band(x)[1],
    ]
    for ask in asked:
        assert isinstance(ask(3.0), float)
        assert ask([3.0, 4.0]).shape == (2,)
        assert ask([3.0])[0] == ask(3.0)
