"""Published results of impact dynamics, redrawn: orbits of a slender block, an oscillator that sticks to its stop."""

import math
from pathlib import Path
from typing import NamedTuple

import mpmath as mp
import numpy as np
import pytest
from oracles import closed_orbits, sticking_oscillator

import rocking
from rocking import dynamics, pulses

UNIT = 1.0 / (2.0 * math.pi)  # natural frequency of the oscillators, Hz: 1 rad/s

#: Restitution and place of the stop, sigma, of Budd and Dux's oscillator, x'' + x = cos(w t), x < sigma; and to two
#: digits the frequency up to which complete chattering is looked for.
STICKING = [
    (0.5, 0.0, 0.61), (0.5, -0.3, 0.82), (0.5, 0.3, 0.47),
    (0.8, 0.0, 0.34), (0.8, -0.3, 0.36), (0.8, 0.3, 0.25),
    (0.9, 0.0, 0.21), (0.9, -0.3, 0.28), (0.9, 0.3, 0.14),
]  # fmt: skip


def oscillator(restitution, sigma):
    """Return its mirror image, y = -x: y > -sigma."""
    return dynamics.ImpactOscillator(UNIT, restitution, stop=sigma)


def forcing(frequency, cycles=1):
    return pulses.sine(1.0, frequency * UNIT, cycles=cycles, phase=0.5 * math.pi)


class Sticking(NamedTuple):
    """How long the mass rests in the period after it has left the stop, and the bracket on its rest since then."""

    time: float
    bracket: tuple[float, float] | None


def sticking(restitution, sigma, frequency):
    motion = forcing(frequency, 2)
    response = dynamics.simulate(
        oscillator(restitution, sigma), motion, duration=motion.duration, initial_position=-sigma
    )
    (_, release), *later = response.rest_intervals
    if not later or later[0][0] > release + 0.5 * motion.duration:
        return Sticking(0.0, None)
    (start, end), row = later[0], response.sequences[0]
    return Sticking(end - start, (row["lower"] - release, row["upper"] - release))


def boundary(restitution, sigma, about):
    """Frequency beyond which it does not rest in the period after its release."""
    low, high = 0.95 * about, 1.05 * about
    assert sticking(restitution, sigma, low).time > 0.0 == sticking(restitution, sigma, high).time
    for _ in range(36):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if sticking(restitution, sigma, middle).time else (low, middle)
    return 0.5 * (low + high)


@pytest.mark.parametrize(
    ("restitution", "sigma", "frequency"),
    [(0.5, -0.3, 0.6), (0.8, 0.0, 0.3),
     *(pytest.param(*each, marks=pytest.mark.thorough)
       for each in ((0.8, 0.0, 0.344), (0.9, 0.3, 0.1), (0.5, 0.0, 0.05), (0.9, -0.3, 0.28), (0.5, 0.3, 0.47)))],
)  # fmt: skip
def test_chattering_of_the_oscillator_ends_within_its_proven_bracket(restitution, sigma, frequency):
    found = sticking(restitution, sigma, frequency)
    with mp.workdps(40):
        exact = sticking_oscillator.Oscillator(restitution, sigma, frequency)
        ends = exact.rest(1e-8) - exact.release
        period = 2 * mp.pi / frequency
    lower, upper = found.bracket
    rounding = 8.0 * np.spacing(float(period))
    assert lower - rounding <= float(ends) <= upper + rounding and upper - lower < 1e-9
    assert found.time == pytest.approx(float(period - ends), abs=upper - lower + rounding)


@pytest.mark.cases(fast=1, thorough=4)
@pytest.mark.parametrize(
    ("restitution", "sigma", "about"),
    [STICKING[0], *(pytest.param(*each, marks=pytest.mark.thorough) for each in STICKING[1:])],
)
def test_complete_chattering_is_lost_where_forty_digits_say(restitution, sigma, about):
    """The mass would come to rest at the instant of its release: nothing is left of the time in which it sticks."""
    found = boundary(restitution, sigma, about)
    with mp.workdps(40):
        below, above = (sticking_oscillator.Oscillator(restitution, sigma, found + d) for d in (-1e-11, 1e-11))
        assert below.is_complete() and not above.is_complete()


@pytest.mark.cases(fast=0, thorough=1)
@pytest.mark.parametrize(("restitution", "sigma", "about"), STICKING[::4])
def test_a_branch_of_orbits_that_stick_ends_at_that_boundary(restitution, sigma, about):
    def family(frequency):
        return oscillator(restitution, sigma), forcing(frequency)

    known = boundary(restitution, sigma, about)
    start = 0.9 * known
    (orbit,) = (each for each in dynamics.periodic_orbits(*family(start), starts=[[-sigma, 0.0]]) if each.has_rest)
    branch = dynamics.continue_orbit(orbit, family, start, (0.85 * known, 1.1 * known))
    (lost,) = branch.bifurcations
    assert branch.ends[1] == lost.kind == "loss of complete chattering"
    assert lost.value == pytest.approx(known, abs=1e-11)
    assert np.all(branch.multipliers == 0.0)


def test_an_orbit_that_sticks_forgets_everything():
    """Its derivative is exactly zero, and states around it lead to the same state, at a distance as well as near."""
    judged = 0
    for restitution, sigma, frequency in ((0.8, 0.0, 0.3), (0.5, -0.3, 0.6)):
        body, motion = oscillator(restitution, sigma), forcing(frequency)
        (orbit,) = (each for each in dynamics.periodic_orbits(body, motion, starts=[[-sigma, 0.0]]) if each.has_rest)
        assert orbit.impact_count == math.inf and orbit.multipliers.tolist() == [0.0, 0.0]
        strobe = dynamics.stroboscopic_map(body, motion)
        near = orbit.state + np.array([[0.0, 0.0], [1e-3, 0.0], [0.0, -1e-3], [-1e-3, 1e-3], [1e-8, 1e-8]])
        after, change = strobe.derivative(near, 2)
        assert not np.any(change)
        assert np.all(np.abs(after - orbit.state) < 1e-13)
        judged += len(near)
    assert judged == 10


# --- Hogan's orbits of a slender block --------------------------------------------------------------------------

P, ALPHA = 1.0, 0.1

#: Forcing frequency over p, restitution, and periods of the motion in which the block hits the ground twice.
HOGAN = [(3.0, 0.925, 1), (3.0, 0.925, 3), (4.0, 0.85, 3), (2.0, 0.8, 1)]


def slender(ratio, restitution, m):
    """Block, its orbits in closed form, and what makes (block, motion) of the peak acceleration over g alpha."""
    block = rocking.Block.from_parameters(p=P, alpha=ALPHA, restitution=restitution)
    frequency = ratio * P * UNIT
    exact = closed_orbits.Block(P, ALPHA, restitution, frequency, block.gravity, m)
    unit = block.gravity * ALPHA
    return exact, unit, lambda level: (block, pulses.sine(level * unit, frequency, cycles=1))


@pytest.mark.parametrize(("ratio", "restitution", "m"), HOGAN)
def test_asymmetric_orbits_double_where_their_two_equations_say(ratio, restitution, m):
    """The orbit of the closed form comes back, and a multiplier of the map is -1 there."""
    exact, unit, family = slender(ratio, restitution, m)
    amplitude, phase, speed = exact.flip
    assert amplitude > exact.amplitude(exact.breaking)
    strobe = dynamics.stroboscopic_map(*family(amplitude / unit), model="linear")
    state = strobe.convert_impacts([phase / (ratio * P), speed])
    after, change = strobe.derivative(state, m)
    assert after == pytest.approx(state, abs=1e-10)
    assert np.linalg.det(change + np.eye(2)) == pytest.approx(0.0, abs=1e-8)
    assert np.linalg.det(change) == pytest.approx(restitution**4, rel=1e-8)


@pytest.mark.parametrize(
    ("ratio", "restitution", "m"),
    [pytest.param(*each, marks=pytest.mark.slow) for each in HOGAN],
)
def test_branches_of_a_slender_block_bifurcate_where_closed_forms_say(ratio, restitution, m):
    """The first fold is sharp beside the range of the parameter, and an impact there is near the start of a period."""
    exact, unit, family = slender(ratio, restitution, m)
    fold, breaking = (exact.amplitude(each) / unit for each in (exact.fold, exact.breaking))
    flip = exact.flip[0] / unit
    below, level = 0.97 * breaking, 0.5 * (breaking + flip)

    def orbits_at(level):
        found = dynamics.periodic_orbits(*family(level), period=m, model="linear")
        return [each for each in found if each.is_stable and each.period == m and each.impact_count == 2.0]

    (whole,) = (each for each in orbits_at(below) if each.is_symmetric)
    one_sided = next(each for each in orbits_at(level) if not each.is_symmetric)
    symmetric = dynamics.continue_orbit(whole, family, below, (0.5 * fold, 1.05 * breaking), step=0.2)
    kinds = {each.kind: each.value for each in symmetric.bifurcations}
    assert kinds["fold"] == pytest.approx(fold, rel=1e-9)
    assert kinds["symmetry breaking"] == pytest.approx(breaking, rel=1e-9)
    other = dynamics.continue_orbit(one_sided, family, level, (0.9 * breaking, 1.1 * flip), step=0.2)
    kinds = {each.kind: each.value for each in other.bifurcations}
    assert kinds["symmetry breaking"] == pytest.approx(breaking, rel=1e-9)
    assert kinds["flip"] == pytest.approx(flip, rel=1e-9)


# --- the tables of the pages ------------------------------------------------------------------------------------

ROOT = Path(__file__).parents[1]


def rows_of(table):
    lines = (ROOT / "docs" / "_tables" / table).read_text("utf-8").splitlines()[2:]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


def test_the_table_of_a_slender_block_holds_the_closed_forms():
    rows = rows_of("orbits-slender.txt")
    assert len(rows) == 2
    for row, m in zip(rows, (1, 3), strict=True):
        exact, unit, _ = slender(3.0, 0.925, m)
        breaking = exact.amplitude(exact.breaking)
        wanted = exact.amplitude(exact.fold), breaking, breaking, exact.flip[0]
        assert [float(cell) for cell in row[1:]] == pytest.approx([each / unit for each in wanted], abs=1e-10)
