"""What no body, map, orbit or chattering sequence is, is refused in one sentence."""

import functools
import math

import numpy as np
import pytest

from rocking import Block, RockingError, chattering, dynamics, pulses
from rocking.chattering import chattering_map, chattering_time, families
from rocking.dynamics import BouncingBall, ImpactOscillator, InvertedPendulum, simulate
from rocking.errors import BlockError, MotionError, OptionError

BLOCK = Block.from_parameters(p=2.0, alpha=0.2, restitution=0.8)
BALL = BouncingBall(0.5)
STOPPED = ImpactOscillator(1.0, 0.7, damping_ratio=0.1, stop=0.02, second_stop=0.03)
PULSE, TABLE = pulses.one_sine(1.0, 1.0), pulses.sine(12.0, 5.0, cycles=1)
ONE = {"a": [1.03], "omega": [2.0]}

orbits, basins, strobe = dynamics.periodic_orbits, dynamics.basins, dynamics.stroboscopic_map
exponents = functools.partial(dynamics.lyapunov_exponents, BALL, TABLE)


def family(level):
    return BALL, TABLE.scaled(level)


@functools.cache
def orbit():
    return orbits(*family(1.0), starts=16)[0]


def diagram(case=family, values=(1.0, 2.0), starts=(0.1, 0.5), **options):
    return dynamics.bifurcation_diagram(case, values, starts, **options)


def continued(value=1.0, limits=(0.9, 1.7), start=None, **options):
    return dynamics.continue_orbit(start or orbit(), family, value, limits, **options)


def chattered(a=1.03, omega=2.0, eta=0.92, **options):
    return chattering_time(a, omega, eta, **options)


CALLS = [
    (lambda: BouncingBall(1.2), BlockError, "restitution must be from 0 to 1"),
    (lambda: ImpactOscillator(1.0, 0.5, damping_ratio=1.0), BlockError, "damping_ratio"),
    (lambda: ImpactOscillator(1.0, 0.5, stop=0.1, second_stop=-0.2), BlockError, "must be above -stop"),
    (lambda: InvertedPendulum(2.0, -0.1, 0.5), BlockError, "gap"),
    (lambda: simulate(BouncingBall(1.0), None, initial_position=1.0), OptionError, "as this bouncing ball, never"),
    (lambda: simulate(InvertedPendulum(3.0, 0.1, 1.0), PULSE), OptionError, "as this inverted pendulum, never"),
    (lambda: simulate(BALL, None, initial_position=-1.0), OptionError, "in front"),
    (lambda: simulate(InvertedPendulum(2.0, 0.1, 0.5), None, initial_position=0.2), OptionError, "-0.1 to 0.1 m"),
    (lambda: simulate(BALL, None, initial_velocity=-1.0), OptionError, "into it"),
    (lambda: simulate(BALL, None, chattering="velocity=-1"), OptionError, "a positive number, in m/s, or of a block"),
    (lambda: simulate(3, None), BlockError, "of rocking.dynamics is required, not int"),
    (lambda: simulate(ImpactOscillator(1.0, 0.5, stop=0.1), None), OptionError, "duration"),
    (lambda: simulate(Block(width=0.2, height=1.0), None), BlockError, "rocking.simulate"),
    (lambda: dynamics.LinearBodies([]), BlockError, "same kind"),
    (lambda: simulate(BALL, PULSE.with_vertical(PULSE)), MotionError, "one line"),
    (lambda: strobe(BLOCK, None), MotionError, "one period"),
    (lambda: strobe(BLOCK, [0.1]), MotionError, "Motion"),
    (lambda: strobe(BLOCK, TABLE)([0.1]), OptionError, "pairs"),
    (lambda: strobe(BALL, TABLE, model="nonlinear"), OptionError, "linear"),
    (lambda: strobe(BALL, TABLE)([0.0, -1.0]), OptionError, "^states must not point into a stop"),
    (lambda: strobe(BALL, TABLE)([-1.0, 0.0]), OptionError, "^states must be at least 0 m, in front of"),
    (lambda: strobe(BALL, TABLE).from_impacts([0.0, -1.0]), OptionError, "away"),
    (lambda: orbits(BALL, TABLE, starts=[[math.nan, 0.0]]), OptionError, "starts must be finite"),
    (lambda: orbits(BALL, TABLE, starts=[]), OptionError, "starts must contain pairs"),
    (lambda: orbits(BALL, TABLE, starts=[[-1.0, 0.0]]), OptionError, "starts must be at least 0 m"),
    (lambda: orbits(BALL, TABLE, starts=[[0.0, -1.0]]), OptionError, "^starts must not point into a stop"),
    (lambda: orbits(BALL, pulses.sine(1e29, 5.0, cycles=1)), MotionError, r"must be below 1e\+12 g"),
    (lambda: continued(start="none"), OptionError, "periodic_orbits"),
    (lambda: continued(2.0), OptionError, "value must be"),
    (lambda: continued(limits=(2.0, 1.0)), OptionError, "lower, higher"),
    (lambda: continued(1.3), OptionError, "is not periodic for family"),
    (lambda: diagram(3), OptionError, "function of the parameter"),
    (lambda: diagram(lambda value: value), OptionError, "must return a body"),
    (lambda: diagram(lambda value: (BALL, None)), MotionError, "one period"),
    (lambda: diagram(values=[2.0, 1.0]), OptionError, "increasing"),
    (lambda: diagram(starts=[0.1]), OptionError, "pair"),
    (lambda: diagram(starts=[-0.1, 0.0]), OptionError, "in front"),
    (lambda: diagram(starts=[0.0, 1e308]), OptionError, "starts must be finite"),
    (lambda: diagram(direction="sideways"), OptionError, "direction"),
    (lambda: exponents([[0.1, 0.0]]), OptionError, "pair"),
    (lambda: exponents([0.0, math.inf]), OptionError, "state must be finite"),
    (lambda: exponents([0.0, -1.0]), OptionError, "^state must not point into a stop"),
    (lambda: basins(BLOCK, TABLE, [0.1, 0.0], [0.0]), OptionError, "positions must be increasing"),
    (lambda: basins(BALL, TABLE, [0.0, 1.0], [0.0, 1e308]), OptionError, "velocities must be finite"),
    (lambda: basins(BALL, TABLE, [0.0, 1.0], [-1.0, 1.0]), OptionError, "^velocities must not point into a stop"),
    (lambda: basins(STOPPED, TABLE, [0.0, 0.03], [0.0, 1.0]), OptionError, "^velocities .* 1 m/s at 0.03 m;"),
    (lambda: basins(BALL, TABLE, [-1.0, 1.0], [0.0, 1.0]), OptionError, "^positions must be at least 0 m"),
    (lambda: basins(BLOCK, TABLE, [0.1], []), OptionError, "velocities"),
    (lambda: chattered(np.nan), OptionError, "a must be finite"),
    (lambda: chattered([1.0, np.inf]), OptionError, r"at index \(1,\)"),
    (lambda: chattered(omega=0.0), OptionError, "omega must be between"),
    (lambda: chattered(eta=0.0), OptionError, "eta must be above 0"),
    (lambda: chattered(eta=0.9999999), OptionError, "eta must be above 0"),
    (lambda: chattered([1.0, 1.1], [1.0, 2.0, 3.0]), OptionError, "do not broadcast"),
    (lambda: chattered(method="euler"), OptionError, "method must be"),
    (lambda: chattered(method="series", order=2.5), OptionError, "order must be"),
    (lambda: chattering.chattering_sequence([1.03, 1.04], 2.0, 0.92), OptionError, "single number"),
    (lambda: chattering.chattering_sequence(0.99, 2.0, 0.92), OptionError, "so that the block uplifts"),
    (lambda: chattering.chattering_sequence(1.03, 2.0, 0.92, tolerance=0.0), OptionError, "tolerance"),
    (lambda: chattering.critical_amplitude(2.0, 0.92, method="eq78"), OptionError, "method must be"),
    *(
        (lambda given=given: chattering_map(families.sine(BLOCK), given), OptionError, words)
        for given, words in (
            ({"a": [1.0]}, "must contain two"),
            ({"a": [1.0], "b": [1.0], "c": [1.0]}, "must contain two"),
            ({"a": [], "b": [1.0]}, "a must be increasing"),
            ({"a": [1.0, math.nan], "b": [1.0]}, "a must be increasing"),
            ({"a": [2.0, 1.0], "b": [1.0]}, "a must be increasing"),
        )
    ),
    (lambda: chattering_map("sine", ONE), OptionError, "family must be a function"),
    (lambda: chattering_map(lambda a, b: (BLOCK, None, "linear"), ONE), OptionError, "SimulationInput"),
    (lambda: chattering_map(lambda a, b: families.SimulationInput(BLOCK, None), ONE), OptionError, "a Motion"),
    (lambda: families.sine("block"), BlockError, "not a str"),
    (lambda: families.lobes(BLOCK, count=2.5), OptionError, "count must be a whole number"),
    (lambda: families.record("a.csv", 0.2), MotionError, "rocking.read"),
]  # fmt: skip


@pytest.mark.parametrize(("call", "error", "words"), CALLS)
def test_it_is_refused_in_one_sentence(call, error, words):
    with pytest.raises(RockingError, match=words) as caught:
        call()
    assert isinstance(caught.value, error) and "\n" not in str(caught.value)
