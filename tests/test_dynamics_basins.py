"""Basins against plain iteration and against an integration by SciPy; their measures against closed forms."""

import math

import numpy as np
import pytest
from numpy.random import default_rng

import rocking
from rocking import Block, dynamics, pulses
from rocking.dynamics.attractors import KnownAttractors
from rocking.dynamics.bifurcation import find_period, record_states

BLOCK = Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9)
SHAKING = pulses.sine(3.5, 1.2, cycles=1)


def drawn(seed):
    """A body, one period of a sine, and a grid of states, over wide ranges."""
    rng = default_rng(seed)
    kind = seed % 7
    e = rng.uniform(0.3, 0.95)
    if kind < 3:
        p, alpha = rng.uniform(1.0, 4.0), rng.uniform(0.05, 0.4)
        body = Block.from_parameters(p=p, alpha=alpha, restitution=e)
        omega, amplitude = rng.uniform(1.0, 8.0), rng.uniform(0.8, 3.0) * np.tan(alpha) * 9.80665
        motion = pulses.sine(amplitude, omega * p / (2.0 * np.pi), cycles=1, phase=rng.uniform(0.0, 6.0))
        ranges = (-alpha, alpha), (-p * alpha, p * alpha)
        return body, motion, ranges, "nonlinear" if kind else "linear"
    motion = pulses.sine(rng.uniform(3.0, 30.0), rng.uniform(0.5, 3.0), cycles=1)
    if kind == 3:
        return dynamics.BouncingBall(e), motion, ((0.0, 0.5), (0.1, 2.0)), None
    if kind == 5:
        pendulum = dynamics.InvertedPendulum(rng.uniform(1.0, 5.0), 0.3, e)
        return pendulum, motion.scaled(0.3), ((-0.29, 0.29), (-1.0, 1.0)), None
    damping, stop = rng.uniform(0.0, 0.2), rng.uniform(0.0, 0.2)
    if kind == 6:
        between = dynamics.ImpactOscillator(1.0, e, damping_ratio=damping, stop=stop, second_stop=0.3)
        return between, motion.scaled(0.3), ((0.01, 0.29), (-1.0, 1.0)), None
    return dynamics.ImpactOscillator(1.0, e, damping_ratio=damping, stop=stop), motion, ((0.01, 0.3), (-1.0, 1.0)), None


def compared(seed, cells, periods=200):
    """Cells judged, cells whose plain iteration contradicts the basins, and those of them that are ambiguous."""
    body, motion, (low, high), model = drawn(seed)
    x, v = np.linspace(*low, cells), np.linspace(*high, cells)
    found = dynamics.basins(body, motion, x, v, periods, model=model)
    strobe = dynamics.stroboscopic_map(body, motion, model=model)
    states = np.stack(np.meshgrid(x, v), axis=-1).reshape(-1, 2)
    plain, fates, _ = strobe.advance(states, periods)
    names, outcome = found.data.attractor.values, found.data.outcome.values.ravel()
    size = np.array([np.ptp(x), np.ptp(v)])
    judged, wrong, ambiguous = 0, 0, 0
    for k, name in enumerate(names):
        here = outcome == k
        if name == "not settled":
            continue
        judged += np.count_nonzero(here)
        if name.startswith("overturns"):
            off = here & (fates != dynamics.PeriodOutcome.OVERTURNED)
        else:
            orbit = np.stack([found.data.orbit_coordinate.values[k], found.data.orbit_velocity.values[k]], axis=-1)
            apart = np.nanmin(np.abs((plain[:, None] - orbit) / size).max(axis=2), axis=1, initial=9.0)
            # A slow approach is still on its way.
            late = found.data.multiplier.values[k] ** (
                (periods - found.data.periods.values.ravel()) / found.data.period.values[k]
            )
            off = here & ~(apart < 1e-6 + 0.1 * late)
        wrong += np.count_nonzero(off)
        for state in states[off]:
            near, near_fates, _ = strobe.advance(state + 1e-9 * size * default_rng(1).normal(size=(40, 2)), periods)
            ambiguous += len(set(near_fates.tolist())) > 1 or np.ptp(near, axis=0).max() > 0.01 * size.min()
    return judged, wrong, ambiguous


@pytest.mark.parametrize(
    ("seeds", "cells"),
    [
        (range(7), 6),
        pytest.param(range(7), 12, marks=pytest.mark.thorough),
        pytest.param(range(7, 60), 12, marks=pytest.mark.slow),
    ],
    ids=["few", "some", "more"],
)
def test_a_state_goes_where_plain_iteration_takes_it(seeds, cells):
    found = np.array([compared(seed, cells) for seed in seeds])
    judged, wrong, ambiguous = found.sum(axis=0)
    assert judged > 0.7 * cells**2 * len(seeds)
    assert wrong == ambiguous <= judged / 1000


@pytest.mark.thorough
def test_the_order_of_work_and_threads_do_not_count():
    x, v = np.linspace(-0.2, 0.2, 36), np.linspace(-0.4, 0.4, 31)
    with rocking.set_options(threads=1):
        one = dynamics.basins(BLOCK, SHAKING, x, v)
    with rocking.set_options(threads=3):
        two = dynamics.basins(BLOCK, SHAKING, x, v)
    assert one.data.identical(two.data)
    assert one.data.share.values.sum() == pytest.approx(1.0)
    assert one.data.standard_error.values == pytest.approx(np.sqrt(one.data.share * (1.0 - one.data.share) / (36 * 31)))
    assert np.count_nonzero(one.data.outcome.values < 0) == 0


@pytest.mark.thorough
def test_a_state_at_any_point_of_a_long_orbit_has_settled_on_it():
    """A few points of a long orbit have a neighbourhood; a cell may end at another one, before or after it is known."""
    strobe = dynamics.stroboscopic_map(dynamics.BouncingBall(0.5, gravity=10.0), pulses.sine(16.92, 5.0, cycles=1))
    states = np.stack(np.meshgrid(np.linspace(0.05, 0.15, 5), np.linspace(0.3, 0.7, 5)), axis=-1).reshape(-1, 2)
    kept = record_states(strobe, states, 400, 64)[0]
    periods = [find_period(each) for each in kept]
    assert sorted(set(periods)) == [4, 23]
    known = KnownAttractors(strobe, np.array([0.1, 0.4]))
    owners = known.classify_or_search(kept[:, -1])
    assert [each.period for each in known.attractors] in ([4, 23], [23, 4])
    assert [known.attractors[owner].period for owner in owners] == periods
    on = kept[periods.index(23)][:23]
    assert np.count_nonzero(known.classify(strobe._to_structs(on)[1]) == -1) > KnownAttractors.MAX_TRIES
    assert set(known.classify_or_search(on).tolist()) == {owners[periods.index(23)]} and len(known.attractors) == 2


@pytest.mark.parametrize("width", [1e-2, 1e-6, 1e-9, 0.0])
def test_a_small_part_of_a_grid_has_the_same_attractor(width):
    x, v = np.linspace(0.02, 0.02 + width, 3), np.linspace(0.1, 0.1 + 2.0 * width, 3)
    found = dynamics.basins(BLOCK, SHAKING, *((x, v) if width else (x[:1], v[:1])))
    assert found.data.attractor.values.tolist() == ["period 1, 2 impacts"]


def test_what_rests_is_an_attractor_and_a_chaotic_state_has_not_settled():
    still = dynamics.basins(BLOCK, pulses.sine(1.0, 1.0, cycles=1), np.linspace(-1e-3, 1e-3, 9), [0.0])
    assert still.data.attractor.values.tolist() == ["rest"] and still.data.share.values == [1.0]
    assert still.data.has_rest.values.tolist() == [True] and still.data.multiplier.values == [0.0]
    ball = dynamics.BouncingBall(0.8, gravity=10.0)
    chaos = dynamics.basins(ball, pulses.sine(30.0, 5.0, cycles=1), np.linspace(0.0, 0.5, 9), [0.0, 0.5])
    assert chaos.data.attractor.values.tolist() == ["not settled"]
    assert np.all(chaos.data.periods.values == 200) and math.isnan(chaos.data.multiplier.values[0])


def test_an_orbit_that_neither_attracts_nor_repels_is_no_attractor():
    """Without damping and impacts every state comes back after two periods of a motion twice as fast."""
    free = dynamics.ImpactOscillator(1.0, 0.5, stop=1.0)
    found = dynamics.basins(free, pulses.sine(0.1, 2.0, cycles=1), np.linspace(-0.1, 0.1, 5), [0.0, 0.1], 50)
    assert found.data.attractor.values.tolist() == ["not settled"]


def test_a_neighbourhood_holds_what_enters_it():
    judged = 0
    for seed in (0, 2, 3, 4):
        body, motion, (low, high), model = drawn(seed)
        strobe = dynamics.stroboscopic_map(body, motion, model=model)
        known = KnownAttractors(strobe, np.array([np.ptp(low), np.ptp(high)]))
        ends, fates, _ = strobe.advance(default_rng(seed).uniform(*np.transpose([low, high]), (20, 2)), 300)
        known.classify_or_search(ends[fates != dynamics.PeriodOutcome.OVERTURNED])
        for trap, owner in zip(known.traps, known.attractor_of_trap, strict=True):
            if trap[0] < 0:
                continue
            shape = np.linalg.cholesky(np.array([[trap[3], trap[4]], [trap[4], trap[5]]]))
            disc = default_rng(seed).normal(size=(200, 2))
            disc *= np.sqrt(default_rng(seed + 1).uniform(size=(200, 1))) / np.linalg.norm(disc, axis=1, keepdims=True)
            uv = trap[1:3] + disc @ np.linalg.inv(shape)
            states = strobe._to_coordinates(
                *uv[uv[:, 0] > 0.0].T, np.full(np.count_nonzero(uv[:, 0] > 0.0), int(trap[0]))
            )
            attractor = known.attractors[owner]
            for _ in range(3):
                states = strobe(states, attractor.period)
                assert np.all(known.classify(strobe._to_structs(states)[1]) == owner)
            judged += len(states)
    assert judged > 500


def test_an_attractor_that_rests_at_the_start_of_a_period_is_known_after_one():
    ball, table = dynamics.BouncingBall(0.3, gravity=10.0), pulses.sine(11.0, 2.0, cycles=1)
    found = dynamics.basins(ball, table, np.linspace(0.0, 0.1, 41), np.linspace(0.01, 0.5, 41), period_count=5)
    assert not dynamics.stroboscopic_map(ball, table)([0.05, 0.0]).any()
    taken, counts = np.unique(found.data.periods.values, return_counts=True)
    # The first cells come before the attractor is known, and all others after it.
    assert (taken.tolist(), counts.tolist()) == ([1, 5], [1281, 400])
    assert len(np.unique(found.data.attractor.values)) == 1
