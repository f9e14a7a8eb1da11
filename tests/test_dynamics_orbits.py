"""Periodic orbits and branches of them, against closed forms, 40 digits, and independent simulations."""

import functools
import math

import numpy as np
import pytest
from oracles import closed_orbits

from rocking import Block, dynamics, pulses
from rocking.chattering import critical_amplitude
from rocking.dynamics.maps import compute_distances
from rocking.errors import OptionError

G = 10.0
TABLE = 5.0  # Hz

BLOCK = Block.from_parameters(p=2.0, alpha=0.2, restitution=0.8)
OSCILLATOR = dynamics.ImpactOscillator(1.0, 0.8, damping_ratio=0.05, stop=0.04, second_stop=0.04)

# So few starts find all that the usual thousand do.
CASES = {
    "ball": (dynamics.BouncingBall(0.5, gravity=G), (16.0, TABLE), {"starts": 128}),
    "oscillator": (dynamics.ImpactOscillator(1.0, 0.8, damping_ratio=0.05, stop=0.01), (3.0, 1.3), {"starts": 64}),
    "oscillator between stops": (OSCILLATOR, (5.0, 0.9), {"starts": 64}),
    "pendulum": (dynamics.InvertedPendulum(3.0, 0.1, 0.7), (6.0, 0.8), {"starts": 64}),
    "linear block": (BLOCK, (2.4, 1.2), {"model": "linear", "period": 3, "starts": 256}),
    "nonlinear block": (BLOCK, (2.4, 1.2), {}),
}


@pytest.fixture(scope="module")
def found():
    return {
        name: dynamics.periodic_orbits(body, pulses.sine(*motion, cycles=1), **options)
        for name, (body, motion, options) in CASES.items()
    }


@pytest.mark.thorough
def test_every_orbit_comes_back_and_none_is_there_twice(found):
    judged = 0
    for name, orbits in found.items():
        assert orbits, name
        for orbit in orbits:
            strobe = dynamics.stroboscopic_map(orbit.body, orbit.motion, model=orbit.model)
            size = 1.0 + abs(orbit.multipliers[0])
            assert strobe(orbit.state, orbit.period) == pytest.approx(orbit.state, abs=1e-12 * size)
            for shorter in range(1, orbit.period):
                assert np.max(np.abs(strobe(orbit.state, shorter) - orbit.state)) > 1e-6
            judged += 1
        for k, one in enumerate(orbits):
            for other in orbits[:k]:
                if one.period == other.period:
                    assert all(np.max(np.abs(state - one.state)) > 1e-9 for state in other.states)
    assert judged >= 30


def test_areas_shrink_by_restitution_and_damping_alone(found):
    judged = 0
    for name, orbits in found.items():
        body, _, _ = CASES[name]
        damping = body.equation.damping if not isinstance(body, Block) else 0.0
        e = body.restitution
        for orbit in orbits:
            if not orbit.has_rest and abs(orbit.multipliers[0]) < 1e3:
                expected = e ** (2.0 * orbit.impact_count) * math.exp(-damping * orbit.duration)
                assert complex(orbit.multipliers.prod()) == pytest.approx(expected, rel=1e-8)
                judged += 1
    assert judged >= 20


def test_a_symmetric_orbit_is_its_mirror_image_half_a_period_later(found):
    symmetric = asymmetric = 0
    for orbits in found.values():
        for orbit in orbits:
            times = orbit.duration * np.linspace(0.01, 0.49, 7)
            now, later = (orbit.response.states(times + shift)[:, 0] for shift in (0.0, 0.5 * orbit.duration))
            assert orbit.is_symmetric == bool(np.all(np.abs(now + later) < 1e-7))
            symmetric, asymmetric = symmetric + orbit.is_symmetric, asymmetric + (not orbit.is_symmetric)
    assert symmetric >= 6 and asymmetric >= 10
    # Where there is one side, or another restitution on each, no orbit is.
    assert not any(orbit.is_symmetric for orbit in found["ball"])
    leaning = Block.from_parameters(p=2.0, alpha=0.2, restitution=(0.8, 0.82))
    assert not any(each.is_symmetric for each in dynamics.periodic_orbits(leaning, pulses.sine(2.4, 1.2, cycles=1)))


def test_a_stable_orbit_attracts_and_an_unstable_one_repels(found):
    stable = unstable = 0
    for orbits in found.values():
        for orbit in orbits:
            largest = abs(orbit.multipliers[0])
            if 0.9 < largest < 1.1 or orbit.has_rest or not 0 < orbit.impact_count < 5 or largest > 50.0:
                continue
            strobe = dynamics.stroboscopic_map(orbit.body, orbit.motion, model=orbit.model)
            near = orbit.state * (1.0 + 1e-7)
            distances = np.max(np.abs(strobe.orbit(near, 12 * orbit.period)[:: orbit.period] - orbit.state), axis=1)
            if orbit.is_stable:
                assert distances[-1] < 0.1 * distances[0]
                stable += 1
            else:
                assert np.nanmax(distances) > 5.0 * distances[0] or np.isnan(distances[-1])
                unstable += 1
    assert stable >= 5 and unstable >= 10


def test_an_orbit_with_a_rest_has_multipliers_zero():
    ball, table = dynamics.BouncingBall(0.5, gravity=G), pulses.sine(12.0, TABLE, cycles=1)
    (rest,) = [each for each in dynamics.periodic_orbits(ball, table, starts=32) if each.has_rest]
    assert rest.impact_count == math.inf and rest.is_stable
    assert rest.multipliers.tolist() == [0.0, 0.0]
    assert rest.response.events["kind"].tolist() == ["rest", "uplift"]
    (still,) = [each for each in dynamics.periodic_orbits(ball, 0.5 * table, starts=32) if each.has_rest]
    assert still.state.tolist() == [0.0, 0.0] and still.impact_count == 0.0
    assert "always at rest" in still.summary()
    # A wall on either side holds the pendulum.
    pendulum, motion = dynamics.InvertedPendulum(3.0, 0.1, 0.5), pulses.sine(0.3, 0.8, cycles=1)
    walls = dynamics.periodic_orbits(pendulum, motion, starts=32)
    assert sorted(each.state[0] for each in walls if each.has_rest) == [-0.1, 0.1]


def test_the_linear_response_of_an_oscillator_that_misses_its_stop_is_an_orbit():
    body, motion = dynamics.ImpactOscillator(1.0, 0.8, damping_ratio=0.05, stop=0.05), pulses.sine(1.0, 1.3, cycles=1)
    (free,) = [each for each in dynamics.periodic_orbits(body, motion) if each.impact_count == 0.0]
    w0, w = 2.0 * math.pi, 2.6 * math.pi
    transfer = -1.0 / complex(w0 * w0 - w * w, 2.0 * 0.05 * w0 * w)
    assert free.state == pytest.approx([transfer.imag, w * transfer.real], abs=1e-15)
    decay, turn = math.exp(-0.05 * w0 / 1.3), w0 * math.sqrt(1.0 - 0.05**2) / 1.3
    expected = decay * np.exp([1j * turn, -1j * turn])
    assert sorted(free.multipliers, key=lambda each: each.imag) == pytest.approx(
        sorted(expected, key=lambda each: each.imag), abs=1e-13
    )


@pytest.mark.thorough
def test_orbits_of_a_shorter_period_are_listed_with_their_own():
    ball, table = dynamics.BouncingBall(0.5, gravity=G), pulses.sine(15.5, TABLE, cycles=1)
    once, twice = (dynamics.periodic_orbits(ball, table, period=period) for period in (1, 2))
    assert {each.period for each in once} == {1} and {each.period for each in twice} == {1, 2}
    known = [each for each in twice if each.period == 1 and each.impact_count == 1.0]
    for each in known:
        twin = min(once, key=lambda other: np.max(np.abs(other.state - each.state)))
        assert twin.state == pytest.approx(each.state, abs=1e-12)
        assert twin.multipliers == pytest.approx(each.multipliers, rel=1e-10)
    assert len(known) == 2


def table_of(ball):
    one_g = pulses.sine(G, TABLE, cycles=1)
    return lambda level: (ball, one_g.scaled(level))


@functools.cache
def ball_between_fold_and_flip(restitution, n):
    """Closed form, level, orbits that bounce once in n periods, and the branch through them and both bifurcations."""
    exact = closed_orbits.Ball(restitution, n)
    family = table_of(dynamics.BouncingBall(restitution, gravity=G))
    level, span = exact.fold + 0.6 * (exact.flip - exact.fold), exact.flip - exact.fold
    orbits = dynamics.periodic_orbits(*family(level), period=n, starts=128 if n == 1 else None)
    once = [each for each in orbits if each.period == n and each.impact_count == 1.0]
    start, limits = next(each for each in once if each.is_stable), (exact.fold - 0.1 * span, exact.flip + 0.1 * span)
    return exact, level, once, dynamics.continue_orbit(start, family, level, limits, name="level")


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("restitution", "n"),
    [
        pytest.param(e, n, marks=() if (e, n) == (0.5, 1) else pytest.mark.slow)
        for e in (0.3, 0.5, 0.8)
        for n in (1, 2, 3)
    ],
)
def test_a_ball_bounces_once_every_n_periods_between_the_levels_of_luck_and_mehta(restitution, n):
    exact, level, once, branch = ball_between_fold_and_flip(restitution, n)
    assert [each.is_stable for each in once].count(True) == 1
    for each in once:
        assert complex(each.multipliers.sum()) == pytest.approx(exact.trace(level, stable=each.is_stable), abs=1e-9)
        assert complex(each.multipliers.prod()) == pytest.approx(restitution**2, abs=1e-9)
    kinds = {each.kind: each.value for each in branch.bifurcations}
    assert kinds["fold"] == pytest.approx(exact.fold, abs=1e-10)
    assert kinds["flip"] == pytest.approx(exact.flip, abs=1e-10)


@pytest.mark.parametrize(
    ("shape", "kind"),
    [((1.0, 0.8, 0.02, 0.02, 2.2), "flip"),
     pytest.param((1.0, 0.8, 0.05, 0.01, 1.3), "fold", marks=pytest.mark.slow),
     pytest.param((1.0, 0.8, 0.05, -0.02, 2.4), "fold", marks=pytest.mark.slow)],
)  # fmt: skip
def test_orbits_of_an_oscillator_that_hits_once_are_those_of_shaw_and_holmes(shape, kind):
    frequency, e, damping, stop, shaking = shape
    exact = closed_orbits.Oscillator(*shape)
    k = getattr(exact, kind)
    body = dynamics.ImpactOscillator(frequency, e, damping_ratio=damping, stop=stop)
    assert exact.speed(k) > 0.0
    value = exact.amplitude(k)
    near = exact.amplitude(1.1 * k if kind == "fold" else 0.98 * k)

    unit = pulses.sine(1.0, shaking, cycles=1)

    def family(amplitude):
        return body, unit.scaled(amplitude)

    starts = 128 if kind == "flip" else None
    once = [each for each in dynamics.periodic_orbits(*family(near), starts=starts) if each.impact_count == 1.0]
    assert once
    expected = [1.1 * k] if kind == "fold" else [0.98 * k]
    for orbit in once:
        speed = orbit.response.impacts["speed_after"][0]
        assert exact.amplitude(speed / exact.beta) == pytest.approx(near, rel=1e-11)
        assert complex(orbit.multipliers.sum()) == pytest.approx(exact.trace(speed / exact.beta), abs=1e-9)
        assert complex(orbit.multipliers.prod()) == pytest.approx(exact.determinant, abs=1e-10)
    start = min(once, key=lambda each: abs(each.response.impacts["speed_after"][0] - exact.speed(expected[0])))
    most = 8 if kind == "flip" else 1000  # the flip is near the start
    branch = dynamics.continue_orbit(start, family, near, (0.8 * value, 1.3 * value), max_points=most)
    found = [each.value for each in branch.bifurcations if each.kind == kind]
    assert found == pytest.approx([value], abs=1e-10)


def test_grazing_is_found_from_both_sides():
    """The linear response touches the stop at a known amplitude; orbits with an impact begin there, too."""
    body = dynamics.ImpactOscillator(1.0, 0.8, damping_ratio=0.05, stop=0.01)
    w0, w = 2.0 * math.pi, 2.6 * math.pi
    exact = 0.01 * math.hypot(w0 * w0 - w * w, 2.0 * 0.05 * w0 * w)

    unit = pulses.sine(1.0, 1.3, cycles=1)

    def family(amplitude):
        return body, unit.scaled(amplitude)

    start = 0.9 * exact
    judged = 0
    for orbit in dynamics.periodic_orbits(*family(start), starts=128):
        if orbit.impact_count == 0.0 or not orbit.is_stable:
            branch = dynamics.continue_orbit(orbit, family, start, (start, 1.2 * exact))
            (grazing,) = [each for each in branch.bifurcations if each.kind == "grazing"]
            assert grazing.value == pytest.approx(exact, abs=1e-10 if orbit.impact_count else 1e-11)
            assert "grazing" in branch.ends
            judged += 1
    assert judged == 2


@pytest.mark.slow
def test_chattering_ceases_to_be_complete_at_the_critical_amplitude_and_rest_ends_at_uplift():
    body, shaking = Block.from_parameters(p=2.0, alpha=0.2, restitution=0.9), 0.8
    lifts = body.uplift_thresholds("linear")[0]
    critical = float(critical_amplitude(2.0 * math.pi * shaking / 2.0, 0.9)) * lifts

    def family(amplitude):
        return body, pulses.sine(amplitude, shaking, cycles=1)

    found = {}
    for level in (0.95, 1.01):
        (rest,) = [each for each in dynamics.periodic_orbits(*family(level * lifts), model="linear") if each.has_rest]
        branch = dynamics.continue_orbit(rest, family, level * lifts, (0.9 * lifts, 1.5 * lifts))
        found[level] = {each.kind: each.value for each in branch.bifurcations}
        assert np.all(branch.is_stable)
    assert found[0.95] == {"uplift": pytest.approx(lifts, abs=1e-11)}
    assert found[1.01] == {
        "uplift": pytest.approx(lifts, abs=1e-10), "loss of complete chattering": pytest.approx(critical, abs=1e-10),
    }  # fmt: skip


@pytest.mark.slow
def test_a_doubled_branch_ends_at_the_flip_and_an_asymmetric_one_where_symmetry_breaks():
    exact = closed_orbits.Ball(0.5, 1)
    family = table_of(dynamics.BouncingBall(0.5, gravity=G))
    orbits = dynamics.periodic_orbits(*family(1.55), period=2)
    (twice,) = [each for each in orbits if each.period == 2 and each.is_stable]
    doubled = dynamics.continue_orbit(twice, family, 1.55, (1.5, 1.6))
    assert doubled.ends[0] == "flip"
    assert doubled.bifurcations[0].value == pytest.approx(exact.flip, abs=1e-10)
    block = closed_orbits.Block(2.0, 0.2, 0.8, 1.2, BLOCK.gravity, 3)
    breaking = block.amplitude(block.breaking)

    def rocked(amplitude):
        return BLOCK, pulses.sine(amplitude, 1.2, cycles=1)

    orbits = dynamics.periodic_orbits(*rocked(3.15), period=3, model="linear")
    one_sided = [each for each in orbits if each.period == 3 and not each.is_symmetric and each.is_stable]
    branch = dynamics.continue_orbit(one_sided[0], rocked, 3.15, (2.9, 3.2))
    assert branch.ends[0] == "symmetry breaking"
    assert branch.bifurcations[0].value == pytest.approx(breaking, abs=1e-9)
    assert len(one_sided) == 2  # and its mirror image


@pytest.fixture(scope="module")
def branch():
    return ball_between_fold_and_flip(0.5, 1)[-1]


@pytest.mark.slow
def test_points_of_a_branch_are_orbits_and_stability_changes_at_its_bifurcations(branch):
    e, exact = 0.5, closed_orbits.Ball(0.5, 1)
    stable = branch.is_stable
    judged = 0
    for k in range(0, len(branch), 7):
        orbit = branch.orbit(k)
        strobe = dynamics.stroboscopic_map(orbit.body, orbit.motion)
        assert strobe(branch.states[k]) == pytest.approx(branch.states[k], abs=1e-11)
        assert orbit.multipliers == pytest.approx(branch.multipliers[k], abs=1e-9)
        moving = orbit.response.states(np.linspace(0.0, orbit.duration, 4001))[:, 0]
        assert branch.peaks[k] == pytest.approx(moving.max(), rel=1e-6)
        judged += 1
    assert judged >= 8
    assert np.all(branch.multipliers.prod(axis=1) == pytest.approx(e * e, abs=1e-8))
    on_stable = (branch.values < exact.flip) & (branch.multipliers.sum(axis=1).real < 1.0 + e * e)
    assert np.array_equal(stable, on_stable)
    steps = np.diff(branch.values)
    assert np.any(steps > 0.0) and np.any(steps < 0.0)  # it passes the fold
    with pytest.raises(OptionError, match="index must be a whole number from"):
        branch.orbit(len(branch))


def test_an_orbit_near_which_nothing_grows_or_shrinks_is_neutral():
    """Without damping and impacts the multipliers of the forced motion are exp(+-2 pi i/1.3)."""
    oscillator = dynamics.ImpactOscillator(1.0, 0.8, stop=1.0)
    found = dynamics.periodic_orbits(oscillator, pulses.sine(1.0, 1.3, cycles=1), starts=64)
    (orbit,) = (each for each in found if each.impact_count == 0.0)
    assert not orbit.is_stable and "neutral orbit of 1 period with 0 impacts" in orbit.summary()
    assert orbit.multipliers[0] == pytest.approx(np.exp(2j * math.pi / 1.3).conjugate(), abs=1e-9)


@pytest.mark.thorough
def test_a_rest_that_attracts_nothing_is_neutral():
    """A ball that loses nothing bounces for ever, however near the table it begins."""
    motion = pulses.sine(0.4, 0.7, cycles=1)
    for restitution, word in ((1.0, "neutral"), (0.9, "stable")):
        ball = dynamics.BouncingBall(restitution)
        (orbit,) = dynamics.periodic_orbits(ball, motion, starts=[[0.0, 0.0]])
        assert orbit.has_rest and orbit.is_stable == (word == "stable")
        assert f"{word} orbit of 1 period always at rest" in orbit.summary()
        branch = dynamics.continue_orbit(orbit, lambda level, ball=ball: (ball, motion.scaled(level)), 1.0, (0.9, 1.1))
        assert np.all(branch.is_stable == (word == "stable"))
        near = dynamics.stroboscopic_map(ball, motion)([1e-6, 0.0], 20)
        assert (near[0] > 1e-8) == (word == "neutral")


def test_orbits_of_a_ball_that_loses_nothing_are_never_stable():
    """Areas stay as they are, so that multipliers are a complex pair of size one, or a real one and its inverse."""
    starts = [[2.41991718e-06, -7.13992044e-03], [3.03476625e-06, 8.32868209e-03]]  # of those with many impacts
    found = dynamics.periodic_orbits(dynamics.BouncingBall(1.0), pulses.sine(1e-3, 0.7, cycles=1), starts=starts)
    assert [each.impact_count for each in found] == [617.0, 706.0]
    for orbit in found:
        assert orbit.multipliers[0].imag != 0.0
        assert np.abs(orbit.multipliers) == pytest.approx([1.0, 1.0], abs=1e-9)
        assert not orbit.is_stable and "neutral" in orbit.summary()


@pytest.mark.thorough
def test_the_peak_of_an_orbit_between_walls_is_where_they_are():
    def family(amplitude):
        return dynamics.InvertedPendulum(3.0, 0.1, 0.6), pulses.sine(amplitude, 1.3, cycles=1)

    found = dynamics.periodic_orbits(*family(3.0), starts=64)
    start = next(each for each in found if each.is_stable and each.impact_count == 2.0)
    branch = dynamics.continue_orbit(start, family, 3.0, (2.8, 3.2))
    assert len(branch) >= 5 and branch.peaks == pytest.approx(0.1, rel=1e-14)
    axes = branch.plot().axes[0]  # which would be a flat line
    assert " ".join(axes.get_ylabel().split()) == "position at the start of a period (m)"
    assert np.nanmax(axes.lines[0].get_ydata()) == pytest.approx(branch.states[:, 0].max())


def test_distances_in_a_period_are_those_of_all_pairs() -> None:
    random = np.random.default_rng(5)
    for _ in range(300):
        period = 10.0 ** random.uniform(-2.0, 2.0)
        marks, times = (period * random.uniform(size=random.integers(1, 12)) for _ in range(2))
        away = np.abs(times[:, None] - marks)
        assert compute_distances(times, marks, period).tolist() == np.minimum(away, period - away).min(axis=1).tolist()
