"""Compiled kernels answer what their Python says: of every kind of body, law, treatment and question a small case.

Another process computes the same with compilation the other way round.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from oracles import standing

import rocking
from rocking import Block, Motion, chattering, dynamics, gradient, pulses, simulate, simulate_many
from rocking.chattering import families
from rocking.kernels.compiled import UNCOMPILED

# Compiled kernels wait here for two minutes of Python.
pytestmark = [] if UNCOMPILED else [pytest.mark.slow]

STATUE = Block(width=0.24, height=1.1, mass=100.0)
TWO_SIDED = Block.from_parameters(p=(2.5, 2.2), alpha=(0.15, 0.2), restitution=(0.8, 0.85))
MODELS = ("linear", "nonlinear")

Numbers = Iterator[float]


def shaken(peak: float, seed: int = 1, seconds: float = 1.5) -> Motion:
    return standing.record(np.random.default_rng(seed), peak, seconds)


def told(response: Any) -> Numbers:
    """Numbers of a response: events, impacts, peak, and its course at some times."""
    yield from (response.overturned, response.peak_rotation, response.peak_time, len(response.impacts))
    yield from response.events["time"]
    for impact in list(response.impacts)[:40]:
        yield from (float(impact[name]) for name in impact.dtype.names if name != "side")
    for each in response.sequences:
        yield from (float(each[name]) for name in ("start", "end", "lower", "upper"))
    times = np.linspace(0.0, response.duration, 7)
    yield from np.ravel(response.states(times))


def each_kind(model: str) -> Numbers:
    """Every kind of body as it stands, alone and in an ensemble."""
    for kind in standing.KINDS:
        rng = np.random.default_rng([5, standing.KINDS.index(kind)])
        bodies = [standing.body(kind, rng)[0] for _ in range(2)]
        threshold = float(np.median([min(body.uplift_thresholds(model)) for body in bodies]))
        motion = shaken(2.5 * threshold, seed=2, seconds=0.6)
        if standing.KINDS.index(kind) % 2:
            motion = motion.with_vertical(shaken(4.0, seed=3, seconds=0.6))
        response = simulate(bodies[0], motion, model=model, duration=motion.end + 0.4)
        yield from told(response)
        yield from (response.required_friction, response.minimum_normal_force)
        yield from np.ravel(response.normal_force([0.2, 0.5]))
        if kind in standing.OF_ENSEMBLES:
            with rocking.set_options(threads=1):
                found = simulate_many(bodies, motion, model=model, duration=motion.end + 0.4)
            yield from found.peak_rotation.values.ravel()
            yield from found.rests.values.ravel()


def from_above(model: str) -> Numbers:
    """Blocks released from a rotation, which chatter in free rocking, fall over, or stand at once."""
    for rotation, velocity in ((0.1, 0.0), (-0.05, 0.3), (0.19, 0.4), (1e-9, 0.0)):
        response = simulate(TWO_SIDED, None, model=model, initial_rotation=rotation, initial_velocity=velocity)
        yield from told(response)


def treatments(model: str) -> Numbers:
    """Every chattering scheme."""
    motion = pulses.sine(2.6, 1.2, cycles=1.5)
    for words in ("certified", "velocity=5e-2", "interval=1e-2", "bypass=1e-3", "time"):
        yield from told(simulate(STATUE, motion, model=model, chattering=words))


def derivatives(model: str) -> Numbers:
    """Derivatives by everything given, forwards and backwards."""
    rng = np.random.default_rng(8)
    bodies: list[Any] = [STATUE, TWO_SIDED]
    bodies += [standing.body(kind, rng)[0] for kind in ("wall", "yielding tendon", "falling restitution")]
    for body in bodies:
        threshold = min(body.uplift_thresholds(model))
        motion = shaken(2.0 * threshold, seed=4, seconds=0.5).with_vertical(shaken(2.0, seed=5, seconds=0.5))
        response = simulate(body, motion, model=model)
        found = response.sensitivity
        for table in (found.events, found.impacts[:20], found.peak):
            for row in table:
                yield from map(float, row)
        for of, at in (("peak", None), ("rotation", 0.4), ("velocity", 0.5), ("impact", 1), ("event", 0)):
            try:
                yield from np.ravel(gradient(response, of, at).samples)[::17]
            except rocking.RockingError:
                yield math.nan


def ensembles(model: str) -> Numbers:
    """Ensembles with all that may be asked of them."""
    blocks = [Block.from_parameters(p=4.0, alpha=0.2, restitution=e) for e in (0.5, 0.9)]
    short, up = shaken(6.0, seed=6, seconds=0.3), shaken(12.0, seed=7, seconds=0.3)
    for motion in (short, short.with_vertical(up), pulses.sine(4.0, 3.0, cycles=1)):
        for asked in ({"derivatives": True}, {"include_times": True}):
            with rocking.set_options(threads=1):
                found = simulate_many([*blocks, TWO_SIDED], motion, model=model, duration=0.5, **asked)
            for name in sorted(map(str, found.data_vars)):
                values = found[name].values
                if values.dtype.kind in "fib":
                    yield from values.ravel().astype(float)


def repeated(model: str) -> Numbers:
    """Maps of one period, orbits and Lyapunov exponents."""
    block = Block.from_parameters(p=2.0, alpha=0.3, restitution=0.6)
    motion = pulses.sine(4.0 * 9.81 * 0.3, 4.0, cycles=1)
    section = dynamics.stroboscopic_map(block, motion, model=model)
    for state in ((0.05, 0.1), (0.0, 0.0), (-0.1, 0.2)):
        yield from np.ravel(section.orbit([state], 3))
    yield from np.ravel(section.derivative([(0.05, 0.1)], 2)[1])
    with rocking.set_options(threads=1):
        found = dynamics.basins(block, motion, [-0.1, 0.1], [-0.3, 0.3], 4, model=model)
    for name in ("multiplier", "orbit_coordinate", "orbit_velocity"):
        yield from np.ravel(found.data[name].values)
    slow = pulses.sine(6.0, 1.0, cycles=1)
    with rocking.set_options(threads=1):
        found = dynamics.basins(block, slow, [-0.1, 0.1], [-0.3, 0.3], 4, model=model)
    yield from np.ravel(found.data.multiplier.values)
    exponents = dynamics.lyapunov_exponents(block, motion, (0.05, 0.1), 20, transient_periods=1, model=model)
    yield from (exponents.largest, exponents.smallest)


def oscillators(model: str) -> Numbers:
    """Bodies that are no blocks: a ball, an oscillator between stops, a pendulum."""
    for body in (
        dynamics.BouncingBall(0.5),
        dynamics.ImpactOscillator(3.0, 0.7, 0.05, stop=0.02, second_stop=0.05),
        dynamics.InvertedPendulum(2.0, 0.1, 0.8),
    ):
        for motion in (pulses.sine(6.0, 1.3, cycles=2), shaken(5.0, seed=9, seconds=1.0)):
            yield from told(dynamics.simulate(body, motion, duration=2.0))
        found = simulate_many([body, body], pulses.sine(12.0, 2.0, cycles=2), model="linear", duration=2.0)
        yield from found.peak_rotation.values.ravel()
        section = dynamics.stroboscopic_map(body, pulses.sine(12.0, 2.0, cycles=1))
        yield from np.ravel(section.orbit([(body.stops[0] + 0.01, 0.3)], 4))
    pressed = dynamics.ImpactOscillator(3.0, 0.3, 0.05, stop=-0.02, second_stop=0.06)
    for motion in (pulses.sine(1.0, 1.0, cycles=3), pulses.sine(6.0, 1.0, cycles=2), shaken(3.0, seed=10)):
        yield from told(dynamics.simulate(pressed, motion, duration=3.0))
    for body in (dynamics.BouncingBall(0.2), pressed):
        exponents = dynamics.lyapunov_exponents(
            body, pulses.sine(12.0, 2.0, cycles=1), (0.03, 0.1), 20, transient_periods=0
        )
        yield from (exponents.largest, exponents.smallest, exponents.share_at_rest)


def yielding(model: str) -> Numbers:
    """A tendon that yields, hangs slack and yields again, from the start on or later; and what changes with it."""
    for offset, start, strength in ((0.0, 0.0, 150.0), (0.1, 0.08, 150.0), (-0.1, 0.15, 150.0), (0.12, 0.05, 1e6)):
        body = rocking.RestrainedBlock(STATUE, rocking.Tendon(3e4, 20.0, offset, strength))
        motion = shaken(9.0, seed=11, seconds=0.8)
        response = simulate(body, motion, model=model, initial_rotation=start, duration=2.5)
        yield from told(response)
        for row in response.sensitivity.impacts[:10]:
            yield from map(float, row)
        for of, at in (("peak", None), ("rotation", 0.75), ("event", 0), ("event", -1), ("impact", -1)):
            try:
                found = gradient(response, of, at)
            except rocking.RockingError:
                continue
            yield from (*np.ravel(found.samples)[::13], found.initial_rotation, found.initial_velocity)


def weightless(model: str) -> Numbers:
    """Blocks that the ground leaves without weight, which then leave it on both sides, graze, or rest between."""
    for seed in range(12, 18):
        motion = shaken(3.0, seed).with_vertical(shaken(25.0, seed + 20))
        yield from told(simulate(STATUE, motion, model=model))
    for amplitude in (3.0, 30.0):
        pulse = pulses.rectangular(amplitude, 0.1)
        yield from told(simulate(STATUE, pulse, model=model))
        yield from told(simulate(STATUE, pulse.with_vertical(shaken(25.0, 3, seconds=0.5)), model=model))


def mapped(model: str) -> Numbers:
    """Maps of bodies that rest, overturn, balance or are held; and from impact to impact."""
    push = pulses.sine(2.5, 2.0, cycles=1)
    held = rocking.RestrainedBlock(STATUE, rocking.Tendon(1e3, 100.0), rocking.Spring(50.0), rocking.Damper(5.0))
    lean = rocking.RestrainedBlock(TWO_SIDED, restitution=rocking.Restitution(0.9, 0.5, slope=0.2))
    soft = Block.from_parameters(p=2.0, alpha=0.2, restitution=0.2)
    for body in (STATUE, held, lean, soft):
        for amplitude in (0.01, 1.0, 1.6):
            section = dynamics.stroboscopic_map(body, push.scaled(amplitude), model=model)
            for state in ((0.0, 0.0), (0.01, 0.0), (0.1, 1.5), (0.2, 3.0)):
                yield from np.ravel(section.orbit([state], 2))
                yield from np.ravel(section.derivative([state], 1)[1])
    fallen = dynamics.lyapunov_exponents(STATUE, push.scaled(3.0), (0.0, 0.0), 20, transient_periods=0, model=model)
    yield from (fallen.outcome, fallen.forcing_period)
    ball = dynamics.BouncingBall(0.6)
    states = np.stack(np.meshgrid(np.linspace(0.005, 0.4, 12), [-1.0, 0.1, 1.5]), axis=-1).reshape(-1, 2)
    for body in (dynamics.BouncingBall(0.0), dynamics.ImpactOscillator(3.0, 0.0, 0.05, stop=0.02, second_stop=0.5)):
        section = dynamics.stroboscopic_map(body, pulses.sine(12.0, 2.0, cycles=1))
        yield from np.ravel(section.derivative(states, 2)[1])
    section = dynamics.stroboscopic_map(dynamics.InvertedPendulum(2.0, 0.1, 0.8), pulses.sine(12.0, 2.0, cycles=1))
    yield from np.ravel(section.derivative([(0.0, 0.0)], 2)[1])
    with rocking.set_options(threads=1):
        found = dynamics.basins(ball, pulses.sine(12.0, 2.0, cycles=1), [0.1, 0.3], [0.5, 2.0], 30)
    yield from np.ravel(found.data.outcome.values).astype(float)


def closed(model: str) -> Numbers:
    """Closed sequences of a slender block under a sine: times, brackets, critical amplitudes."""
    yield from chattering.chattering_time([1.02, 1.2, 1.0 + 1e-9, 4.0], [0.5, 2.0, 1.0, 9.0], [0.5, 0.9, 0.7, 0.3])
    yield from chattering.chattering_time([1.02, 1.05], [0.5, 2.0], [0.5, 0.9], method="semianalytical")
    for amplitude, omega, eta in ((1.03, 1.0, 0.7), (1.5, 3.0, 0.9), (1.0 + 1e-7, 0.2, 0.3)):
        found = chattering.chattering_sequence(amplitude, omega, eta)
        yield from (found.is_complete, found.time, found.lower, found.upper, len(found.impacts))
    for excess in (1e-2, 1e-3, 1e-4, 1e-5):
        yield from chattering.chattering_time(1.0 + excess * np.linspace(1.0, 1.5, 33), 0.5, 0.7)
    critical = float(chattering.critical_amplitude(2.0, 0.7))
    yield from chattering.chattering_time(critical * (1.0 - np.array([1e-3, 1e-6, 1e-9, 1e-12, 1e-15])), 2.0, 0.7)
    for resolved in range(1, 10, 2):
        a, omega = np.meshgrid([1.2, 3.0, 10.0, 100.0], [0.1, 1.0, 9.0])
        yield from np.ravel(chattering.chattering_time(a, omega, 0.9, method="semianalytical", impact_count=resolved))
    at_threshold = pulses.sine(min(STATUE.uplift_thresholds(model)), 1.2, cycles=1.5)
    yield from told(simulate(STATUE, at_threshold, model=model, chattering="time"))
    a, omega, eta = np.meshgrid([1.0, 1.0 + 1e-12, 1.03, 1e3], [1e-2, 0.7, 30.0], [0.01, 0.3, 0.97])
    yield from np.ravel(chattering.chattering_time(a, omega, eta))
    yield chattering.chattering_time(1.02, 0.5, 1.0, method="asymptotic")
    yield from told(simulate(STATUE, pulses.sine(1.0, 1.2, cycles=1.5), model=model, chattering="time"))
    for method in ("asymptotic", "series"):
        yield from chattering.chattering_time([1.0, 1.02, 1.05], [0.5, 0.5, 2.0], [0.5, 0.5, 0.9], method=method)
    for method in ("exact", "eq76", "eq77"):
        yield from np.ravel(chattering.critical_amplitude([0.5, 2.0], [0.5, 0.8], method=method))
    yield from np.ravel(chattering.series_coefficients([0.3, 5.0], [0.5, 0.97], order=3))
    family = families.sine(Block.from_parameters(p=1.0, alpha=0.2, restitution=0.9), model=model)
    with rocking.set_options(threads=1):
        shown = chattering.chattering_map(family, {"a": [1.001, 1.05, 3.0], "omega": [0.5, 3.0]})
    yield from shown.data.outcome.values.ravel().astype(float)
    yield from shown.data.upper.values.ravel()


CASES: dict[str, Callable[[str], Numbers]] = {
    case.__name__: case
    for case in (
        each_kind,
        from_above,
        treatments,
        derivatives,
        ensembles,
        repeated,
        oscillators,
        yielding,
        weightless,
        mapped,
        closed,
    )
}


def elsewhere(name: str, model: str) -> list[float]:
    """What a process computes that compiles where this one does not."""
    environment = os.environ | {
        "NUMBA_DISABLE_JIT": "0" if UNCOMPILED else "1",
        "PYTHONPATH": os.pathsep.join([str(Path(__file__).parent), os.environ.get("PYTHONPATH", "")]),
    }
    code = f"import json, {__name__} as cases; print(json.dumps([*map(float, cases.{name}({model!r}))]))"
    command = [sys.executable, "-W", "ignore", "-c", code]
    return json.loads(subprocess.run(command, env=environment, stdout=-1, text=True, check=True).stdout)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("name", CASES)
def test_compiled_kernels_answer_what_their_python_says(name: str, model: str) -> None:
    here = [*map(float, CASES[name](model))]
    assert len(here) > 20
    assert sum(map(math.isnan, here)) < 0.3 * len(here)
    assert here == pytest.approx(elsewhere(name, model), rel=1e-11, abs=1e-13, nan_ok=True)
