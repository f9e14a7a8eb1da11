"""The explorer's periodic view: what a case settles on and its sweeps, against long simulations and its own script."""

import re
import runpy
from collections import namedtuple

import numpy as np
import pytest

import rocking
from rocking.errors import OptionError
from rocking.explorer.code import sweep_as_python
from rocking.explorer.inputs import read_case
from rocking.explorer.periodic import (
    RECORDED_PERIOD_COUNT,
    describe_orbit,
    find_sine,
    read_sweep,
    simulate_sweep,
    sweep_point_to_texts,
)
from rocking.explorer.uploads import UploadStore

BLOCK = {"width": "0.24", "height": "1.1", "restitution": "0.5"}
ECCENTRIC = {"width": "0.24", "height": "1.1", "offset": "0.02"}

#: A state near the orbit of two periods under a sine of 14.5 m/s^2.
ON_TWO = {"initial_rotation": "-0.0872", "initial_velocity": "1.06"}


def case_of(motion, **texts):
    return read_case({**BLOCK, "motion": motion, **texts}, UploadStore())


def sine(amplitude, frequency=2.0):
    return f"sine:amplitude={amplitude!r},frequency={frequency!r},cycles=5"


def long_simulation(case, periods):
    """Response over some periods of the case's sine, and the states at their starts in units of slenderness."""
    given = find_sine(case)
    motion = rocking.pulses.sine(given.amplitude, given.frequency, cycles=periods + 1, phase=given.phase)
    response = rocking.simulate(
        case.block,
        motion,
        model=case.model,
        chattering=case.chattering,
        duration=periods / given.frequency,
        initial_rotation=case.options.get("initial_rotation", 0.0),
        initial_velocity=case.options.get("initial_velocity", 0.0),
    )
    times = np.arange(periods) / given.frequency
    rotation, velocity = response.rotation(times), response.angular_velocity(times)
    plus, minus = case.block.sides
    on_plus = np.where(rotation == 0.0, velocity >= 0.0, rotation > 0.0)
    alpha, p = (np.where(on_plus, getattr(plus, name), getattr(minus, name)) for name in ("alpha", "p"))
    return response, np.stack([rotation / alpha, velocity / (p * alpha)], axis=-1)


@pytest.mark.parametrize(
    ("case", "period", "impacts", "rests", "words"),
    [
        (case_of(sine(6.0)), 1, 2, 0, "1 period with 2 impacts"),
        (case_of(sine(14.5), **ON_TWO), 2, 4, 0, "2 periods with 4 impacts"),
        (case_of(sine(2.4516625)), 3, None, 1, "3 periods with complete chattering"),
        (case_of(sine(2.3)), 1, None, 2, "1 period with complete chattering"),
        (case_of(sine(3.0), model="linear"), 1, 2, 0, "1 period with 2 impacts"),
        (case_of(sine(3.0), **ECCENTRIC), 1, 2, 0, "1 period with 2 impacts"),
    ],
)
def test_what_a_case_settles_on_is_where_a_long_simulation_ends(case, period, impacts, rests, words):
    found = describe_orbit(case)
    assert f"orbit of {words}, multipliers" in found.header["sentence"]
    assert found.header["period"] == period
    response, states = long_simulation(case, 400 + period)
    shown = np.stack([found.arrays["x"], found.arrays["y"]], axis=-1)
    assert len(shown) == period
    apart = np.abs(states[-period:, None] - shown[None]).max(axis=-1)
    assert apart.min(axis=1).max() < 2e-6 and apart.min(axis=0).max() < 2e-6
    for shorter in range(1, period):
        assert np.abs(states[-1] - states[-1 - shorter]).max() > 1e-5
    start = response.duration - period / find_sine(case).frequency
    assert impacts is None or np.sum(response.impacts["time"] >= start) == impacts
    kinds, times = response.events["kind"], response.events["time"]
    assert np.sum((kinds == "rest") & (times >= start) & (times < response.duration)) == rests


def test_multipliers_are_those_of_the_impacts():
    # An arc keeps areas; an impact takes eta^2 of them.
    case = case_of(sine(6.0))
    sentence = describe_orbit(case).header["sentence"]
    texts = sentence.rstrip(".").rpartition("multipliers ")[2].replace(" ", "").replace("i", "j").split(",")
    first, second = map(complex, texts)
    assert (first * second).real == pytest.approx(0.5 ** (2 * 2), rel=3e-3)


@pytest.mark.parametrize("texts", [{}, {**ECCENTRIC, "restitution": "0.5,0.6"}])
def test_the_trajectory_passes_through_the_starts_of_the_periods_and_jumps_at_impacts(texts):
    case = case_of(sine(6.0), **texts)
    arrays = describe_orbit(case).arrays
    line, jumps = np.stack([arrays["rotation"], arrays["velocity"]], axis=-1), arrays["jump"].astype(int)
    assert len(jumps) == 2 and np.array_equal(line[jumps, 0], [0.0, 0.0]) and np.isfinite(line).all()
    for x, y in zip(arrays["x"], arrays["y"], strict=True):
        assert np.min(np.abs(line - [x, y]).max(axis=1)) < 5e-3
    plus, minus = case.block.sides
    for before, after in zip(line[jumps, 1], line[jumps + 1, 1], strict=True):
        left, entered = (minus, plus) if after > 0.0 else (plus, minus)
        ratio = after * entered.p * entered.alpha / (before * left.p * left.alpha)
        assert ratio == pytest.approx(left.restitution, rel=1e-6) or ratio == pytest.approx(
            entered.restitution, rel=1e-6
        )


@pytest.mark.parametrize(
    ("amplitude", "frequency", "eta"), [(2.45, 0.7, "0.5"), (2.26, 1.3, "0.93"), (13.0, 2.0, "0.5")]
)
def test_an_overturning_is_told(amplitude, frequency, eta):
    case = case_of(sine(amplitude, frequency), restitution=eta)
    found = describe_orbit(case)
    response, _ = long_simulation(case, 40)
    assert response.overturned
    assert found.header["sentence"] == "The block overturns within 363 periods."
    assert found.header["period"] == 0 and not len(found.arrays["x"]) and "rotation" not in found.arrays


def test_a_case_without_a_period_is_said_to_have_none():
    case = case_of(sine(15.847), initial_rotation="0.0359", initial_velocity="1.216")
    found = describe_orbit(case)
    assert found.header["sentence"].startswith("No period up to 512 was found")
    assert found.header["period"] == 0 and len(found.arrays["x"]) == 1024


def test_a_scaled_sine_is_the_sine_of_that_amplitude():
    case = case_of("sine:amplitude=2,frequency=2,cycles=2.5,phase=30deg", scale="-3")
    given = find_sine(case)
    times = np.linspace(0.0, 1.2, 200)
    assert given.amplitude > 0.0
    again = rocking.pulses.sine(given.amplitude, given.frequency, cycles=2.5, phase=given.phase)
    assert again.acceleration(times) == pytest.approx(case.motion.acceleration(times), abs=1e-12)


# Sweeps

Steady = namedtuple("Steady", "states period")


def period_in(words):
    """Period that the words at a value of a diagram state."""
    return 1 if words == "stays at rest" else int((re.match(r"period (\d+)", words) or [0, 0])[1])


def swept(sweep):
    """What the finest level of a sweep finds, by direction and number of the value."""
    found, shares, strides = {}, [], []
    for part in simulate_sweep(sweep):
        header, states = part.header, part.arrays["states"].reshape(-1, 2)
        shares.append(header["share"])
        strides.append(header["stride"])
        ends = np.cumsum(header["counts"])[:-1]
        if header["stride"] == 1:
            each = zip(np.split(states, ends), header["words"], strict=True)
            steady = [Steady(found_states, period_in(words)) for found_states, words in each]
            found |= {(header["direction"], index): one for index, one in zip(header["indices"], steady, strict=True)}
    assert np.all(np.diff(shares) > 0.0) and shares[-1] == 1.0
    assert strides[0] == 8 and np.all(np.diff(strides) <= 0)
    return found


@pytest.mark.cases(fast=1)
@pytest.mark.parametrize(
    ("texts", "asked"),
    [
        ({}, {"sweep": "a", "sweep_from": "0.9", "sweep_to": "8.7"}),
        ({"scale": "-1.1"}, {"sweep": "omega", "sweep_from": "2.5", "sweep_to": "5"}),
        ({**ECCENTRIC, "model": "linear", "chattering": "velocity=0.01"}, {"sweep": "a"}),
    ],
)
def test_a_sweep_is_what_its_script_computes(texts, asked, tmp_path):
    case = case_of("sine:amplitude=0.9g,frequency=2,cycles=3,phase=20deg", **texts)
    sweep = read_sweep(case, {**asked, "sweep_points": "24"})
    found = swept(sweep)
    script = tmp_path / "sweep.py"
    script.write_text(sweep_as_python(sweep), "utf-8")
    ran = runpy.run_path(str(script))["found"]
    assert len(found) == ran.data.period.size == 48
    overturned = periodic = 0
    for (direction, index), each in found.items():
        at = ran.data.sel(direction=direction, start=0).isel(value=index)
        states = np.stack([at.coordinate.values, at.velocity.values], axis=-1)
        assert at.value == sweep.axis.values[index] and states.shape == (RECORDED_PERIOD_COUNT, 2)
        assert at.period == (each.period if len(each.states) else -1)
        overturned += not len(each.states)
        periodic += each.period > 0
        assert np.isnan(states[-1]).all() == (not len(each.states))
        assert np.array_equal(states[RECORDED_PERIOD_COUNT - len(each.states) :], each.states)
    assert periodic >= 15 and periodic + overturned >= 24
    assert overturned >= 3 or "model" in texts or "scale" in texts


@pytest.mark.parametrize("points", [12, pytest.param(40, marks=pytest.mark.thorough)])
def test_a_sweep_depends_on_its_direction(points):
    sweep = read_sweep(case_of(sine(9.0)), {"sweep_from": "0.9", "sweep_to": "6", "sweep_points": str(points)})
    found = swept(sweep)
    up, down = ([len(found[each, index].states) for index in range(points)] for each in ("up", "down"))
    # Amplitudes at which a block that rocks goes on, and one from rest overturns; the other way there is none.
    assert sum(a > 0 and not b for a, b in zip(up, down, strict=True)) >= points // 4
    assert not any(b > 0 and not a for a, b in zip(up, down, strict=True))


@pytest.mark.cases(fast=1)
@pytest.mark.parametrize("name", ["a", "omega"])
@pytest.mark.parametrize("texts", [{}, {"pga": "0.8g"}, {"scale": "-0.9"}])
def test_the_case_at_a_point_of_a_sweep_settles_on_that_point(name, texts):
    ends = {"a": ("1.2", "3"), "omega": ("3", "5")}[name]
    case = case_of("sine:amplitude=0.7g,frequency=2,cycles=3", **texts)
    sweep = read_sweep(case, {"sweep": name, "sweep_from": ends[0], "sweep_to": ends[1], "sweep_points": "8"})
    judged = 0
    for (_, index), each in swept(sweep).items():
        if not each.period:
            continue
        value = float(sweep.axis.values[index])
        u, v = map(float, each.states[-1])
        opened = read_case(sweep_point_to_texts(sweep, value, (u, v)), UploadStore())
        assert (opened.options["initial_rotation"], opened.options["initial_velocity"]) == (u, v)
        header = describe_orbit(opened).header
        assert header["at"][name] == pytest.approx(value, rel=1e-12)
        assert header["period"] == each.period
        again = read_sweep(opened, {"sweep": name})
        assert again.choose_sine(1.0)[:3] == sweep.choose_sine(1.0)[:3]
        judged += 1
    assert judged >= 10
    assert "initial_rotation" not in sweep_point_to_texts(sweep, 2.0)


def test_a_part_of_a_sweep_is_sent_with_rotations_over_slenderness():
    sweep = read_sweep(case_of(sine(6.0)), {"sweep_points": "16", "sweep_to": "8.7"})
    words = set()
    for payload in simulate_sweep(sweep):
        states = payload.arrays["states"].reshape(-1, 2)
        assert sum(payload.header["counts"]) == len(states) == len(payload.arrays["drawn"])
        assert payload.arrays["drawn"] == pytest.approx(states[:, 0] / sweep.case.block.alpha)
        assert [count == 0 for count in payload.header["counts"]] == payload.header["overturned"]
        words |= {*payload.header["words"]}
    assert {"stays at rest", "period 1", "overturns"} <= words


@pytest.mark.parametrize(
    ("motion", "asked", "words"),
    [
        ("ridgecrest-clc-090", {}, "requires a sine"),
        (sine(3.0), {"sweep": "mass"}, "must be one of a, omega"),
        (sine(3.0), {"sweep_points": "7"}, "from 8 to 400"),
        (sine(3.0), {"sweep_from": "3", "sweep_to": "2"}, "must be positive and below"),
        (sine(3.0), {"sweep_from": "0"}, "must be positive and below"),
    ],
)
def test_a_sweep_that_is_none_is_refused(motion, asked, words):
    with pytest.raises(OptionError, match=words):
        read_sweep(case_of(motion), asked)
