"""Maps from period to period against simulations, finite differences and closed forms."""

import math
import time

import numpy as np
import pytest

import rocking
from rocking import Block, dynamics, pulses
from rocking.errors import OptionError

BLOCK = Block.from_parameters(p=2.0, alpha=0.2, restitution=0.8)
LEANING = Block.from_parameters(p=(2.0, 2.2), alpha=(0.2, 0.15), restitution=(0.8, 0.85))
CASES = {
    "linear block": (BLOCK, "linear", (2.4, 1.2)),
    "nonlinear block": (BLOCK, "nonlinear", (2.4, 1.2)),
    "block of two sides": (LEANING, "nonlinear", (2.4, 1.2)),
    "ball": (dynamics.BouncingBall(0.7), None, (25.0, 3.0)),
    "oscillator": (dynamics.ImpactOscillator(1.0, 0.8, damping_ratio=0.05, stop=0.01), None, (3.0, 1.3)),
    "oscillator between stops": (dynamics.ImpactOscillator(1.0, 0.8, stop=0.05, second_stop=0.04), None, (5.0, 0.9)),
    "pendulum": (dynamics.InvertedPendulum(3.0, 0.1, 0.7), None, (6.0, 0.8)),
}


def starts(body, count, seed):
    """States that every body may have."""
    rng = np.random.default_rng(seed)
    low, high = body.stops
    if isinstance(body, Block):
        low, high = -0.05, 0.05
    elif high == low:
        high = low + 0.1
    return np.column_stack([low + (high - low) * rng.uniform(0.1, 0.9, count), 0.2 * rng.normal(size=count)])


def simulated(body, model, motion, state, duration):
    if isinstance(body, Block):
        found = rocking.simulate(
            body, motion, model=model, duration=duration, initial_rotation=state[0], initial_velocity=state[1]
        )
        return found, found.states(duration)[:2]
    found = dynamics.simulate(body, motion, duration=duration, initial_position=state[0], initial_velocity=state[1])
    return found, found.states(duration)[:2]


@pytest.mark.parametrize("name", CASES)
def test_the_map_is_a_simulation_of_as_many_periods(name):
    body, model, (amplitude, frequency) = CASES[name]
    one, many = (pulses.sine(amplitude, frequency, cycles=count) for count in (1, 9))
    strobe = dynamics.stroboscopic_map(body, one, model=model)
    given = starts(body, 20, 1)
    orbits = strobe.orbit(given, 8)
    # How much the last place of the motion, which is not the same for one period as for nine, may change.
    changes = np.array([np.linalg.norm(strobe.derivative(given, n)[1], axis=(1, 2)) for n in range(1, 9)])
    judged = moving = 0
    for k, (state, orbit) in enumerate(zip(given, orbits, strict=True)):
        found, _ = simulated(body, model, many, state, 8.5 / frequency)
        for n in range(9):
            time = n / frequency
            if n == 0 or time >= found.duration:
                continue
            near = len(found.impacts) and np.min(np.abs(found.impacts["time"] - time)) < 1e-9
            if not near and np.isfinite(changes[n - 1, k]):
                assert orbit[n] == pytest.approx(found.states(time)[:2], abs=2e-12 * max(1.0, changes[n - 1, k]))
                judged += 1
                moving += orbit[n, 1] != 0.0
    assert judged > 100 and moving > 20
    after, fates, _ = strobe.advance(given, 8)
    assert np.array_equal(after, orbits[:, -1], equal_nan=True)
    assert np.all((fates == dynamics.PeriodOutcome.OVERTURNED) == np.isnan(after[:, 0]))


@pytest.mark.parametrize("name", CASES)
def test_the_derivative_is_that_of_finite_differences_and_zero_after_a_rest(name):
    body, model, (amplitude, frequency) = CASES[name]
    strobe = dynamics.stroboscopic_map(body, pulses.sine(amplitude, frequency, cycles=1), model=model)
    given = starts(body, 60, 2)
    after, change = strobe.derivative(given)
    assert np.array_equal(after, strobe(given), equal_nan=True)
    differences, counts = np.empty_like(change), [strobe.advance(given)[2]]
    for column, step in enumerate(2e-6 * np.eye(2)):
        found = {k: strobe.advance(given + k * step) for k in (-2, -1, 1, 2)}
        difference = 8.0 * (found[1][0] - found[-1][0]) - (found[2][0] - found[-2][0])
        differences[:, :, column] = difference / (12.0 * 2e-6)
        counts += [each[2] for each in found.values()]
    # A difference across another number of impacts is none.
    same = np.all(np.array(counts) == counts[0], axis=0) & np.all(np.abs(change) < 50.0, axis=(1, 2))
    rests = after[:, 1] == 0.0
    assert np.all(change[rests] == 0.0)
    assert change[same] == pytest.approx(differences[same], rel=1e-6, abs=1e-7)
    assert np.count_nonzero(same & ~rests) > 10


@pytest.mark.parametrize(
    ("body", "motion", "chattering", "size"),
    [
        (dynamics.BouncingBall(0.0, gravity=10.0), (25.0, 5.0), "certified", (0.3, 1.0)),
        (dynamics.InvertedPendulum(3.0, 0.1, 0.0), (30.0, 5.0), "certified", (0.1, 2.5)),
        (Block.from_parameters(p=2.0, alpha=0.2, restitution=0.5), (9.0, 2.0), "velocity=0.5", (0.15, 0.3)),
    ],
)
def test_a_rest_that_the_ground_ends_at_once_is_not_forgotten(body, motion, chattering, size):
    """An impact that leaves no speed where the ground draws back: when the body leaves depends on when it came."""
    strobe = dynamics.stroboscopic_map(body, pulses.sine(*motion, cycles=1), chattering=chattering)
    given = np.random.default_rng(5).uniform(-0.99, 0.99, (120, 2)) * size
    if isinstance(body, dynamics.BouncingBall):
        given[:, 0] = np.abs(given[:, 0]) + 1e-3
    _, change = strobe.derivative(given)
    differences = {}
    for step in (1e-6, 2e-6):
        columns = [(strobe(given + step * each) - strobe(given - step * each)) / (2.0 * step) for each in np.eye(2)]
        differences[step] = np.stack(columns, axis=-1)
    smooth = np.all(np.abs(differences[1e-6] - differences[2e-6]) < 1e-6, axis=(1, 2))
    assert change[smooth] == pytest.approx(differences[1e-6][smooth], rel=1e-6, abs=1e-6)
    # After such an impact nothing but its time is left of the state before: one multiplier is zero, the other is not.
    flat = np.abs(np.linalg.det(change)) < 1e-12
    assert np.count_nonzero(smooth & flat & np.any(change != 0.0, axis=(1, 2))) >= 10


STOPPED = dynamics.ImpactOscillator(1.0, 0.7, damping_ratio=0.1, stop=0.02, second_stop=0.03)


@pytest.mark.parametrize(
    ("body", "motion", "state", "inwards"),
    [
        (dynamics.ImpactOscillator(1.0, 0.7, damping_ratio=0.1, stop=0.02), (0.4, 0.7, 0.0), (-0.02, 0.0), 1.0),
        (dynamics.ImpactOscillator(1.0, 0.7, damping_ratio=0.1), (-0.4, 0.7, 0.0), (0.0, 0.0), 1.0),  # with no jump
        (STOPPED, (0.4, 0.7, 0.0), (-0.02, 0.0), 1.0),
        (STOPPED, (0.4, 0.7, 0.0), (0.03, 0.0), -1.0),
        (dynamics.InvertedPendulum(3.0, 0.1, 0.6), (2.0, 1.0, 0.5 * math.pi), (0.1, 0.0), -1.0),
        (BLOCK, (3.0, 3.0, 0.5 * math.pi), (0.0, 0.0), -1.0),
        (BLOCK, (-3.0, 3.0, 0.5 * math.pi), (0.0, 0.0), 1.0),
    ],
)
def test_a_body_on_a_stop_that_does_not_hold_it_is_not_at_rest(body, motion, state, inwards):
    """Its derivative is that of what begins in front of the stop, in differences to that side."""
    amplitude, frequency, phase = motion
    strobe = dynamics.stroboscopic_map(body, pulses.sine(amplitude, frequency, cycles=1, phase=phase))
    after, change = strobe.derivative(state)
    h = inwards * np.array([1e-7, 2e-7])
    once, twice = (np.column_stack([strobe(state + each * step) - after for each in np.eye(2)]) / step for step in h)
    assert np.abs(change).max() > 0.05
    assert change == pytest.approx(2.0 * once - twice, rel=2e-5, abs=1e-6)


@pytest.mark.parametrize(
    ("body", "state"),
    [
        (BLOCK, (0.0, 0.0)),
        (dynamics.BouncingBall(0.7), (0.0, 0.0)),
        (dynamics.ImpactOscillator(1.0, 0.7, stop=0.1, second_stop=-0.03), (-0.03, 0.0)),
    ],
)
def test_a_body_that_is_held_at_rest_forgets_how_it_began(body, state):
    _, change = dynamics.stroboscopic_map(body, pulses.sine(0.4, 0.7, cycles=1)).derivative(state)
    assert not np.any(change)


def test_area_shrinks_by_the_square_of_the_restitution_at_each_impact_and_by_damping():
    damped = dynamics.ImpactOscillator(1.0, 0.8, damping_ratio=0.05, stop=0.01)
    body, motion = damped, pulses.sine(3.0, 1.3, cycles=1)
    strobe = dynamics.stroboscopic_map(body, motion)
    given = starts(body, 40, 3)
    _, change = strobe.derivative(given)
    _, fates, impacts = strobe.advance(given)
    known = (fates == dynamics.PeriodOutcome.MOVES) & (impacts < 6)
    drag = math.exp(-2.0 * 0.05 * 2.0 * math.pi * 1.0 / 1.3)
    # Seen at fixed times an impact multiplies areas by e squared times the ratio of energies, which is one.
    assert np.linalg.det(change[known]) == pytest.approx(drag * 0.8 ** (2.0 * impacts[known]), rel=1e-9)
    assert np.count_nonzero(known) > 20


@pytest.mark.parametrize("name", ["nonlinear block", "oscillator"])
def test_what_no_body_follows_is_not_a_number_at_once(name):
    """Such a state used to be marched for all the turns that a period may take: seconds, for each state."""
    body, model, (amplitude, frequency) = CASES[name]
    motion = pulses.sine(amplitude, frequency, cycles=1)
    strobe = dynamics.stroboscopic_map(body, motion, model=model)
    wrong = [[math.nan, 0.0], [0.0, math.nan], [0.0, math.inf], [0.05, 1e308]]
    _ = strobe.advance([0.01, 0.1]), strobe.derivative([0.01, 0.1])  # compiled
    before = time.process_time()
    after, fates, _ = strobe.advance([*wrong, [0.01, 0.1]], 5)
    assert np.isnan(after[:-1]).all() and np.isfinite(after[-1]).all()
    assert fates.tolist() == [dynamics.PeriodOutcome.UNFINISHED] * 4 + [dynamics.PeriodOutcome.MOVES]
    assert all(np.isnan(each).all() for each in strobe.derivative(wrong, 3))
    assert time.process_time() - before < 2.0


def test_one_state_does_not_depend_on_others_and_shapes_are_kept():
    body, model, (amplitude, frequency) = CASES["nonlinear block"]
    strobe = dynamics.stroboscopic_map(body, pulses.sine(amplitude, frequency, cycles=1), model=model)
    given = starts(body, 600, 5)
    together = strobe(given.reshape(2, 300, 2), 3)
    assert together.shape == (2, 300, 2)
    alone = np.array([strobe(state, 3) for state in given[::50]])
    assert np.array_equal(together.reshape(-1, 2)[::50], alone, equal_nan=True)


def any_body(rng):
    e = rng.uniform(0.1, 0.98)
    kind = rng.integers(5)
    if kind == 0:
        sides = rng.uniform(0.5, 6.0, 2), rng.uniform(0.05, 0.5, 2), rng.uniform(0.5, 0.95, 2)
        p, alpha, restitution = (tuple(each) for each in sides)
        return Block.from_parameters(p=p, alpha=alpha, restitution=restitution), "linear"
    if kind == 1:
        return dynamics.BouncingBall(e), None
    if kind == 2:
        return dynamics.InvertedPendulum(10.0 ** rng.uniform(-0.5, 1.0), 10.0 ** rng.uniform(-3.0, 0.0), e), None
    damping, stop = rng.choice([0.0, rng.uniform(0.0, 0.5)]), rng.uniform(-0.05, 0.2)
    second = None if kind == 3 else 0.3
    body = dynamics.ImpactOscillator(
        10.0 ** rng.uniform(-1.5, 0.7), e, damping_ratio=damping, stop=stop, second_stop=second
    )
    return body, None


@pytest.mark.parametrize(
    ("seed", "count"), [(0, 50), *(pytest.param(seed, 200, marks=pytest.mark.thorough) for seed in (0, 1))]
)
def test_steps_over_pieces_in_closed_form_are_what_the_march_finds(seed, count):
    rng = np.random.default_rng(seed)
    judged = stepped = 0
    for _ in range(count):
        body, model = any_body(rng)
        frequency = 10.0 ** rng.uniform(-0.5, 1.0)
        amplitude = 10.0 ** rng.uniform(-0.5, 1.8)
        motion = pulses.sine(amplitude, frequency, cycles=1, phase=rng.uniform(0.0, 6.0))
        strobe, marched = (dynamics.stroboscopic_map(body, motion, model=model) for _ in range(2))
        marched._steps = strobe._steps[:, :0]
        given = starts(body, 20, int(rng.integers(2**31)))
        (found, fates, impacts), (expected, known, counted) = (each.advance(given) for each in (strobe, marched))
        assert np.array_equal(fates, known) and np.array_equal(impacts, counted)
        _, change = marched.derivative(given)
        # Rounding grows as the derivative says.
        allowed = 1e-14 * (1.0 + np.abs(given).max() + np.nanmax(np.abs(expected), initial=0.0))
        allowed = allowed * (20.0 + np.nan_to_num(np.abs(change).max(axis=(1, 2)), posinf=1e300))
        error = np.nan_to_num(np.abs(found - expected).max(axis=-1))
        assert np.all(error <= allowed)
        judged += np.count_nonzero(fates == dynamics.PeriodOutcome.MOVES)
        stepped += strobe._steps.shape[1] > 0
    assert judged > 7.5 * count and stepped > 0.5 * count


@pytest.mark.parametrize(("sign", "stops"), [(1.0, (-0.01, 0.05)), (-1.0, (0.05, -0.01))])
def test_a_spring_that_presses_against_one_of_two_stops_brings_the_body_to_rest_there(sign, stops):
    two = dynamics.ImpactOscillator(1.0, 0.8, stop=stops[0], second_stop=stops[1])
    one = dynamics.ImpactOscillator(1.0, 0.8, stop=-0.01)  # as long as the other stop is not reached
    found = dynamics.simulate(two, None, initial_position=sign * 0.02)
    expected = dynamics.simulate(one, None, initial_position=0.02)
    assert found.events["time"][-1] == pytest.approx(expected.events["time"][-1], rel=1e-9)
    times = np.linspace(0.0, found.duration, 50)
    assert sign * found.position(times) == pytest.approx(expected.position(times), abs=1e-12)
    free = dynamics.ImpactOscillator(1.0, 0.8, stop=0.01, second_stop=0.05)
    shaking = pulses.sine(0.5, 2.0, cycles=1)
    lively = dynamics.ImpactOscillator(1.0, 1.0, stop=stops[0], second_stop=stops[1])
    with pytest.raises(OptionError, match="restitution 1"):
        dynamics.simulate(lively, shaking)
    with pytest.raises(OptionError, match="not pressed against a stop"):
        dynamics.simulate(free, None)


def test_a_body_under_a_motion_without_acceleration_rests():
    (orbit,) = dynamics.periodic_orbits(dynamics.BouncingBall(0.5), pulses.sine(0.0, 5.0, cycles=1), starts=64)
    assert orbit.has_rest and orbit.impact_count == 0.0
