"""Bodies between stops against an independent integration with events, closed forms, and wrong input."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import rocking
from rocking import dynamics, pulses
from rocking.errors import OptionError

G = 9.81


def integrated(body, motion, end, position, velocity):
    """Impact times and speeds, state at the end (None: it chatters), highest position; DOP853 from each impact on."""
    stiffness, damping, pull, low, high = body.equation
    times, speeds, t, x, v, peak = [], [], 0.0, position, velocity, position

    def rates(time, y):
        return [y[1], stiffness * y[0] - damping * y[1] - pull - float(motion.acceleration(time))]

    def at_low(_, y):
        return y[0] - low

    def at_high(_, y):
        return (high if math.isfinite(high) else 1e9) - y[0]

    def turns(_, y):
        return y[1]

    events = [at_low, at_high, turns]
    for event in events:
        event.terminal, event.direction = event is not turns, -1
    grid = np.unique(np.append(motion.breakpoints[motion.breakpoints < end], end))
    for piece_end in grid[1:] if grid[0] == 0.0 else grid:
        while t < piece_end:
            found = solve_ivp(
                rates, (t, piece_end), [x, v], "DOP853", rtol=1e-12, atol=1e-14, events=events, max_step=0.02
            )
            t, (x, v) = found.t[-1], found.y[:, -1]
            peak = max(peak, *(high if len(found.t_events[1]) else x, *found.y_events[2].reshape(-1, 2)[:, 0]))
            if found.status == 1:
                times.append(t)
                speeds.append(abs(v))
                x = low if len(found.t_events[0]) else high
                v = -body.restitution * v
                if abs(v) < 2e-2:  # of shorter arcs it misses roots
                    return times[:-1], speeds[:-1], None, peak
    return times, speeds, (x, v), peak


def drawn(seed):
    """A body, a sine, and a start, over wide ranges."""
    rng = np.random.default_rng(seed)
    e = rng.uniform(0.3, 0.95)
    motion = rocking.pulses.sine(rng.uniform(1.0, 30.0), rng.uniform(0.3, 3.0), cycles=4, phase=rng.uniform(0.0, 6.0))
    kind = seed % 5
    if kind == 0:
        return dynamics.BouncingBall(e, gravity=G), motion, rng.uniform(0.05, 1.0), rng.uniform(-1.0, 1.0)
    if kind == 1:
        return dynamics.InvertedPendulum(rng.uniform(1.0, 5.0), 0.3, e), motion, rng.uniform(-0.2, 0.2), 0.3
    damping, stop = rng.uniform(0.0, 0.3) * (kind > 2), rng.uniform(-0.1, 0.3)
    second = rng.uniform(0.2, 0.5) if kind == 4 else None
    frequency = rng.uniform(0.3, 2.0)
    body = dynamics.ImpactOscillator(frequency, e, damping_ratio=damping, stop=stop, second_stop=second)
    return body, motion, max(0.0, -stop) + 0.1, rng.uniform(-1.0, 1.0)


@pytest.mark.parametrize(
    "seeds",
    [
        (0, 1, 4),
        pytest.param(range(12), marks=pytest.mark.thorough),
        pytest.param(range(12, 40), marks=pytest.mark.slow),
    ],
    ids=str,
)
def test_impacts_are_those_of_an_independent_integration(seeds):
    impacts = ends = between = reached = 0  # slow impacts multiply the error of their times
    for seed in seeds:
        body, motion, position, velocity = drawn(seed)
        end = motion.end
        times, speeds, last, peak = integrated(body, motion, end, position, velocity)
        found = dynamics.simulate(body, motion, duration=end, initial_position=position, initial_velocity=velocity)
        known = list(zip(times, speeds, strict=True))
        if len(found.sequences):  # closed by proof before the speed is small
            known = known[: len(found.impacts)]
        assert len(found.impacts) >= len(known)
        if known:
            expected = np.array(known)
            assert found.impacts["time"][: len(known)] == pytest.approx(expected[:, 0], abs=1e-10)
            assert found.impacts["speed_before"][: len(known)] == pytest.approx(expected[:, 1], rel=1e-9)
            assert found.impacts["speed_after"] == pytest.approx(body.restitution * found.impacts["speed_before"])
        if last is not None:
            assert len(found.impacts) == len(known)
            assert found.position(end) == pytest.approx(last[0], abs=1e-10)
            assert found.velocity(end) == pytest.approx(last[1], abs=1e-9)
            assert found.peak_position == pytest.approx(peak, abs=1e-10) and not math.isnan(peak)
            two = math.isfinite(body.equation.high)
            ends, between, reached = ends + 1, between + two, reached + (two and peak == body.equation.high)
            assert ("at the stop" in found.summary()) == (two and peak == body.equation.high)
        impacts += len(known)
    assert impacts > 5 * len(seeds) and ends > len(seeds) // 2
    assert between >= len(seeds) // 5 and len(seeds) // 14 <= reached < between


def test_a_body_rests_at_the_stop_where_it_came_to_rest():
    pendulum = dynamics.InvertedPendulum(3.0, 0.1, 0.6)
    for start, wall in ((0.02, 0.1), (-0.02, -0.1)):
        found = dynamics.simulate(pendulum, None, initial_position=start)
        assert found.position(found.duration) == wall
        assert not found.ambiguous
        assert found.velocity(found.duration) == 0.0
    # The support pulls it off one wall, and only off that one.
    push = rocking.pulses.one_sine(1.2 * 9.0 * 0.1, 0.3)
    left = dynamics.simulate(pendulum, push, initial_position=-0.1)
    right = dynamics.simulate(pendulum, push, initial_position=0.1)
    assert left.events["kind"][0] == right.events["kind"][0] == "uplift"
    assert left.events["side"][0] == 1 and right.events["side"][0] == -1
    assert right.events["time"][0] < 1.6 < left.events["time"][0]
    mirrored = dynamics.simulate(pendulum, push.scaled(-1.0), initial_position=0.1)
    times = np.linspace(0.0, left.duration, 500)
    assert mirrored.position(times) == pytest.approx(-left.position(times), abs=1e-13)


def test_the_ball_on_a_table_that_goes_down_fast_leaves_it():
    ball = dynamics.BouncingBall(0.5, gravity=G)
    found = dynamics.simulate(ball, rocking.pulses.one_sine(1.5 * G, 1.0))
    # -1.5 sin(2 pi t) < -1 first where the table goes down.
    assert found.events["time"][0] == pytest.approx(0.5 + math.asin(1.0 / 1.5) / (2.0 * math.pi), abs=1e-12)


def test_positions_are_right_between_the_proof_and_the_rest():
    # The proof closes the sequence after a few impacts; the ball goes on bouncing until it rests.
    e, height = 0.9, 1.0
    found = dynamics.simulate(dynamics.BouncingBall(e, gravity=10.0), None, initial_position=height)
    assert len(found.impacts) < 20
    speed, time, judged = math.sqrt(2.0 * 10.0 * height), math.sqrt(2.0 * height / 10.0), 0
    for _ in range(60):
        speed *= e
        flight = 2.0 * speed / 10.0
        assert found.position(time + 0.5 * flight) == pytest.approx(speed**2 / 20.0, rel=1e-9, abs=1e-15)
        time += flight
        judged += time > found.impacts["time"][-1]
    assert judged > 40


@pytest.mark.parametrize("restitution", [0.0, 1e-200, 1e-100])
def test_a_rest_at_the_first_impact_is_proven(restitution):
    ball, motion = dynamics.BouncingBall(restitution, gravity=10.0), pulses.sine(15.0, 2.0, cycles=4)
    dropped = dynamics.simulate(ball, None, initial_position=0.2)
    assert dropped.rests_by_rounding == 0 and dropped.sequences["lower"][0] <= 0.2 <= dropped.sequences["upper"][0]
    for body in (
        ball,
        dynamics.InvertedPendulum(2.0, 0.1, restitution),
        dynamics.ImpactOscillator(1.0, restitution, stop=-0.1),
    ):
        found = dynamics.simulate(body, motion, duration=motion.end)
        rests = found.sequences
        assert len(rests) >= 2 and found.rests_by_rounding == 0 and "not proven" not in found.summary()
        proven = found.solution.sequences
        assert np.all(proven["upper"] - proven["lower"] <= 64.0 * np.spacing(rests["end"]))
        assert np.all((rests["lower"] <= rests["end"]) & (rests["end"] <= rests["upper"]))


@pytest.mark.parametrize("entry", ["simulate", "simulate_many", "study"])
@pytest.mark.parametrize(
    "body",
    [
        dynamics.BouncingBall(0.5),
        dynamics.ImpactOscillator(1.0, 0.8, stop=0.01),
        dynamics.InvertedPendulum(3.0, 0.1, 0.7),
    ],
    ids=["ball", "oscillator", "pendulum"],
)
def test_the_entry_points_for_blocks_lead_to_those_for_bodies_between_stops(tmp_path, entry, body):
    """Nobody who gave no model is told of a wrong one alone."""
    calls = {
        "simulate": lambda **model: rocking.simulate(body, pulses.sine(12.0, 5.0, cycles=2), **model),
        "simulate_many": lambda **model: rocking.simulate_many(body, pulses.sine(12.0, 5.0, cycles=2), **model),
        "study": lambda **model: rocking.create_study(
            tmp_path, body, pulses.sine(12.0, 5.0, cycles=2), levels=[1.0], **model
        ),
    }
    with pytest.raises(OptionError, match=r"call rocking.dynamics.simulate, or set model to \"linear\""):
        calls[entry]()
    assert calls[entry](model="linear") is not None
