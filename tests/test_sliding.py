"""Responses with friction against an integration that restarts at events, and their limits."""

import math
import os
import subprocess
import sys
from typing import Any, NamedTuple

import numpy as np
import pytest
from oracles.sliding import G, Slider, follow, sampled, sum_sequence

import rocking
from rocking.block.friction import resolve_friction
from rocking.engine.problem import prepare_ground
from rocking.engine.schemes import Certified
from rocking.engine.tasks import Setup
from rocking.errors import OptionError, RockingError
from rocking.kernels import state
from rocking.kernels.compiled import UNCOMPILED
from rocking.kernels.march import march

pytestmark = pytest.mark.skipif(UNCOMPILED, reason="takes long without compilation")

VERDICTS = {"stays": ("stands", "does not move"), "overturns": ("overturns",), "lost contact": ("loses contact",)}


class Case(NamedTuple):
    block: rocking.Block
    body: Slider
    options: dict[str, Any]
    dt: float
    across: np.ndarray
    up: np.ndarray | None

    @property
    def motion(self) -> rocking.Motion:
        motion = rocking.Motion.from_samples(self.across, dt=self.dt)
        return motion if self.up is None else motion.with_vertical(rocking.Motion.from_samples(self.up, dt=self.dt))


def draw_case(seed: int) -> Case:
    """A body of either model under random samples, often with vertical motion, a start or two coefficients."""
    rng = np.random.default_rng(seed)
    linear = bool(rng.random() < 0.4)
    alpha = rng.uniform(0.06, 0.45, 2)
    if linear or rng.random() < 0.5:
        alpha[1] = alpha[0]
    height = 10.0 ** rng.uniform(-1.0, 0.5)
    distances = tuple((height * np.tan(alpha)).tolist())
    k = math.hypot(distances[0], height) * rng.uniform(0.5, 0.7)
    slope = float(np.tan(alpha.min()))
    mu = min(float(slope * 10.0 ** rng.uniform(-0.5, 0.7)), 1.0)
    friction = mu if rng.random() < 0.7 else (mu, mu * float(rng.uniform(0.6, 1.0)))
    count, dt = int(rng.integers(20, 80)), float(rng.choice([0.01, 0.02, 0.05]))
    size = int(rng.integers(1, 8))

    def draw_samples(peak: float) -> np.ndarray:
        samples = np.convolve(rng.normal(size=count), np.ones(size) / size, "same")
        return samples * peak / np.abs(samples).max()

    across = draw_samples(G * slope * rng.uniform(0.6, 4.0))
    up = draw_samples(rng.uniform(0.0, 6.0)) if rng.random() < 0.5 else None
    start = (0.0, 0.0)
    if rng.random() < 0.3:
        rotation = float(rng.choice([-1.0, 1.0]) * slope * rng.uniform(0.0, 0.9))
        start = (rotation, float(rng.normal() * 0.3 * math.sqrt(G / height) * slope))
    if linear:
        block = rocking.Block(half_width=distances[0], half_height=height)
        p, angles, e = (tuple(getattr(side, name) for side in block.sides) for name in ("p", "alpha", "restitution"))
        body = Slider.slender(p, angles, e, height, friction)
    else:
        block = rocking.Block.from_pivots(distances, height, k)
        body = Slider.on_pivots(distances, height, k, friction)
    options = {"model": "linear" if linear else "nonlinear", "friction": friction}
    options |= {"initial_rotation": start[0], "initial_velocity": start[1]}
    return Case(block, body, options, dt, across, up)


def compare(seed: int) -> rocking.Response:
    case = draw_case(seed)
    response = rocking.simulate(case.block, case.motion, **case.options)
    start = case.options["initial_rotation"], case.options["initial_velocity"]
    up = None if case.up is None else case.up.tolist()
    expected = follow(case.body, sampled(case.dt, case.across.tolist(), up), start)
    assert response.outcome in VERDICTS[expected.verdict], seed
    found = response.peak_rotation, response.residual_slip, response.largest_slip
    assert found == pytest.approx((expected.peak, expected.slip, expected.largest_slip), abs=1e-8), seed
    return response


def test_random_cases_of_both_models() -> None:
    kinds: set[str] = set()
    for seed in range(9):
        kinds |= set(compare(seed).events["kind"].tolist())
    assert {"slide", "stick", "slide-rock", "rest", "uplift", "overturn"} <= kinds


@pytest.mark.slow
@pytest.mark.parametrize("first", range(0, 2000, 100))
def test_two_thousand_random_cases_of_both_models(first: int) -> None:
    for seed in range(first, first + 100):
        compare(seed)


@pytest.mark.parametrize("model", ["nonlinear", "linear"])
def test_infinite_friction_is_a_block_that_never_slips(model: str) -> None:
    case = draw_case(3)
    options = {**case.options, "model": model}
    bound, free = (rocking.simulate(case.block, case.motion, **{**options, "friction": mu}) for mu in (math.inf, None))
    for name in ("events", "impacts", "sequences"):
        assert getattr(bound, name).tobytes() == getattr(free, name).tobytes()
    assert bound.solution.trail.nodes.tobytes() == free.solution.trail.nodes.tobytes()


def test_a_block_that_sticks_rocks_as_without_friction() -> None:
    block = rocking.Block(width=0.4, height=2.0)
    motion = rocking.pulses.one_sine(amplitude=3.0, frequency=2.0)
    sticking, free = rocking.simulate(block, motion, friction=0.8), rocking.simulate(block, motion)
    assert not sticking.slips and sticking.events.tolist() == free.events.tolist()
    assert sticking.peak_rotation == free.peak_rotation
    assert sticking.required_friction == free.required_friction < 0.8


def test_a_block_with_little_friction_only_slides() -> None:
    """Newmark's sliding block: V' = -a -+ mu g, under a constant acceleration and none."""
    block, mu, a, duration = rocking.Block(width=0.6, height=1.2), 0.2, 4.0, 0.5
    response = rocking.simulate(block, rocking.pulses.rectangular(a, duration), friction=mu)
    speed = (a - mu * G) * duration
    distance = 0.5 * speed * duration + 0.5 * speed**2 / (mu * G)
    assert response.peak_rotation == 0.0 and response.outcome == "stands"
    assert response.residual_slip == pytest.approx(-distance, rel=1e-13)
    assert float(response.slip_velocity(duration)) == pytest.approx(-speed, rel=1e-13)
    assert response.events["kind"].tolist() == ["slide", "rest"]
    assert response.required_friction == pytest.approx(mu, rel=1e-12)


def test_mirrored_motions_mirror_slips() -> None:
    block = rocking.Block(width=0.5, height=1.8, restitution=0.85)
    motion = rocking.pulses.one_sine(amplitude=5.0, frequency=2.0)
    first = rocking.simulate(block, motion, friction=0.3)
    second = rocking.simulate(block, motion.scaled(-1.0), friction=0.3)
    times = np.linspace(0.0, first.duration, 101)
    assert first.slips
    np.testing.assert_array_equal(second.slip(times), -first.slip(times))
    np.testing.assert_array_equal(second.rotation(times), -first.rotation(times))


def test_momentum_and_energy_balance_in_every_step() -> None:
    """The centre of mass moves as its forces demand, and friction takes the energy that is missing."""
    nodes, weights = np.polynomial.legendre.leggauss(16)
    checked = 0
    for seed in range(12):
        case = draw_case(seed)
        if case.options["model"] == "linear":
            continue
        response = rocking.simulate(case.block, case.motion, **case.options)
        rows = response.solution.trail.nodes
        for row in range(len(rows) - 1):
            start, end, side = float(rows["time"][row]), float(rows["time"][row + 1]), int(rows["side"][row])
            if not 1e-4 < end - start < 0.1 or (side >= 0 and rows["side"][row + 1] < 0):
                continue
            index = np.full(18, row)
            times = np.concatenate([[start], 0.5 * (start + end) + 0.5 * (end - start) * nodes, [end]])
            states = response._history.compute_states(times, index, columns=5)
            across_force, up_force = response._contact._compute_forces_in(times, index)
            sign = 0 if side < 0 else 1 - 2 * side
            arm, alpha = case.block.sides[max(side, 0)].radius, case.block.sides[max(side, 0)].alpha
            psi, rate, slip_rate = alpha - np.abs(states[:, 0]), sign * states[:, 1], G * states[:, 4]
            across = slip_rate + sign * arm * np.cos(psi) * rate
            upward = arm * np.sin(psi) * rate if sign else 0.0 * rate
            push, lift = response._contact._evaluate_ground(times, index, np.full(18, side < 0))
            net = G * (across_force - push), G * (up_force - 1.0 - lift)
            for velocity, force in zip((across, upward), net, strict=True):
                change = 0.5 * (end - start) * np.sum(weights * force[1:-1])
                assert velocity[-1] - velocity[0] == pytest.approx(change, abs=1e-12)
            inertia = G * arm / case.block.sides[max(side, 0)].p ** 2 - arm**2
            energy = 0.5 * (across**2 + upward**2 + inertia * rate**2 * (sign != 0)) + G * arm * np.cos(psi) * (
                sign != 0
            )
            power = -G * push * across - G * lift * upward + G * across_force * slip_rate
            work = 0.5 * (end - start) * np.sum(weights * power[1:-1])
            assert energy[-1] - energy[0] == pytest.approx(work, abs=1e-12)
            checked += 1
    assert checked > 200


def test_no_force_leaves_the_cone_of_friction() -> None:
    """Forces follow from the rotation alone: a slip that was missed would require more friction than there is."""
    slips = 0
    for seed in range(150):
        case = draw_case(seed)
        if case.options["model"] == "linear":
            continue
        response = rocking.simulate(case.block, case.motion, **case.options)
        assert response.required_friction <= np.max(case.options["friction"]) * (1.0 + 1e-12), seed
        slips += response.slips
    assert slips > 60


# ---- Complete chattering while sliding, in 40 digits ----


class Sequence(NamedTuple):
    block: rocking.Block
    model: str
    friction: float
    side: int
    direction: int
    speed: float


def draw_sequence(seed: int) -> Sequence | None:
    """An impact of a block that slides so fast that it ceases to rock before it sticks."""
    rng = np.random.default_rng(seed)
    model = str(rng.choice(["nonlinear", "linear"]))
    height, slopes = 10.0 ** rng.uniform(-1.0, 0.5), np.tan(rng.uniform(0.08, 0.4, 2))
    if model == "linear" or rng.random() < 0.5:
        slopes[1] = slopes[0]
    distances = tuple((height * slopes).tolist())
    k = math.hypot(max(distances), height) * rng.uniform(0.5, 0.7)
    side, direction = int(rng.integers(2)), int(rng.choice([-1, 1]))
    friction = float(slopes[0 if direction > 0 else 1] * rng.uniform(0.02, 0.85))
    try:
        block = rocking.Block.from_pivots(distances, height, k)
    except RockingError:
        return None
    speed = 10.0 ** rng.uniform(-4.5, -2.0) * min(item.p * item.alpha for item in block.sides)
    return Sequence(block, model, friction, side, direction, speed)


def bracket_by_kernel(case: Sequence) -> tuple[float, float] | None:
    """The proven bracket on the end of the impacts, from the time of the first on."""
    bodies = case.block.as_bodies()
    setup = Setup(bodies, case.model, Certified(), friction=resolve_friction(case.friction))
    run = setup.prepare(None, writes_tables=True)
    start, table = run.states[0], state.create_table(4096)
    start["side"], start["v"], start["direction"] = case.side, case.speed, case.direction
    start["slip_rate"], start["peak"], start["budget"] = 2.0 * case.direction, math.inf, 100_000
    start["certificate_speed"] = math.inf
    march(prepare_ground(None, bodies.gravity), run.structs[0], run.settings, table, state.create_scratch(), start)
    if not start["sequence_count"] or not table["sequence"]["upper"][0] >= 0.0:
        return None
    return float(table["sequence"]["lower"][0]), float(table["sequence"]["upper"][0])


def check_sequences(seeds: range) -> int:
    checked = 0
    for seed in seeds:
        case = draw_sequence(seed)
        bracket = None if case is None else bracket_by_kernel(case)
        if case is None or bracket is None:
            continue
        total = sum_sequence(case)
        assert bracket[0] <= total <= bracket[1], seed
        assert bracket[1] - bracket[0] < 1e-8
        checked += 1
    return checked


def test_brackets_of_chattering_while_sliding_contain_the_accumulation() -> None:
    assert check_sequences(range(25)) >= 12


@pytest.mark.slow
def test_a_thousand_brackets_of_chattering_while_sliding_contain_the_accumulation() -> None:
    assert check_sequences(range(25, 1400)) >= 1000


# ---- Input ----


@pytest.mark.parametrize(
    ("friction", "text"),
    [
        (0.0, "must be a positive number"),
        (-0.2, "must be a positive number"),
        (math.nan, "must be a positive number"),
        ("rough", "number"),
        ((0.3, 0.2, 0.1), "pair"),
        ((0.2, 0.3), "swap them"),
        (1.4, "must be below 1.33"),
    ],
)
def test_friction_out_of_range_is_refused_in_one_sentence(friction: Any, text: str) -> None:
    with pytest.raises(OptionError, match=text) as caught:
        rocking.simulate(rocking.Block(width=0.4, height=2.0), None, friction=friction, initial_rotation=0.1)
    assert "\n" not in str(caught.value)


def test_bodies_that_cannot_slip_are_refused_in_one_sentence() -> None:
    block = rocking.Block(width=0.4, height=2.0, mass=1000.0)
    frame = rocking.Block.from_frame(half_width=0.5, half_height=3.0, mass_ratio=2.0)
    cases: list[tuple[Any, str]] = [
        (rocking.RestrainedBlock(block, rocking.Tendon(1e5)), "not available for blocks with restraints"),
        (rocking.Block.one_sided(width=0.4, height=4.0), "not available for blocks with restraints"),
        (frame, "columns of a frame"),
        (rocking.Block(width=0.4, height=2.0, restitution=0.4), "would gain energy"),
        (rocking.Block.from_parameters((2.0, 2.0), (0.1, 0.3), 0.9), "rigid body"),
    ]
    for body, text in cases:
        with pytest.raises(OptionError, match=text):
            rocking.simulate(body, None, friction=0.3, initial_rotation=0.05)


def test_derivatives_through_a_slip_are_refused() -> None:
    block = rocking.Block(width=0.5, height=1.8)
    response = rocking.simulate(block, rocking.pulses.one_sine(5.0, 2.0), friction=0.3)
    with pytest.raises(OptionError, match="slips"):
        _ = response.sensitivity
    assert response.slips and not response.ambiguous


def test_a_block_that_only_slides_is_not_ambiguous() -> None:
    """Each slide starts on the cone of friction, where rounding may neither end nor repeat it."""
    record = rocking.records.load("ridgecrest-clc-090").scaled(1.5)
    for mu in (0.2, 0.15):
        response = rocking.simulate(rocking.Block(width=0.5, height=1.0), record, friction=mu)
        assert response.peak_rotation == 0.0 and len(response.events) > 100
        starts, ends = response.events["time"].reshape(-1, 2).T
        assert np.all(ends - starts > 1e-6)
        assert not response.ambiguous
        assert response.perturbed(1e-10, 3).event_spreads.max() < 1e-9


def test_a_block_that_slips_on_the_brink_of_overturning_is_ambiguous() -> None:
    block = rocking.Block(width=0.5, height=1.5)

    def respond(amplitude: float) -> rocking.Response:
        motion = rocking.pulses.one_sine(amplitude=amplitude, frequency=1.0)
        return rocking.simulate(block, motion, friction=0.3, initial_rotation=0.05)

    low, high = 3.5, 4.0
    assert not respond(low).overturned and respond(high).overturned
    while low < (middle := 0.5 * (low + high)) < high:
        low, high = (low, middle) if respond(middle).overturned else (middle, high)
    assert respond(low).slips and respond(high).slips
    assert "touch" in respond(high).ambiguities and respond(low).ambiguous
    assert not respond(low * (1.0 - 1e-9)).ambiguous


def test_many_blocks_slip_as_single_ones() -> None:
    """In lanes, unless a bound admits a slip; a block alone is simulated in other steps."""
    motion = rocking.Motion.from_samples(4.0 * np.sin(np.arange(400) * 0.07) ** 3, dt=0.01)
    blocks = rocking.Blocks.grid(p=[1.5, 2.5], alpha=[0.15, 0.3], restitution=[0.9])
    slips = 0
    for model in ("nonlinear", "linear"):
        for moved in (motion, motion.with_vertical(motion.scaled(0.5))):
            data = rocking.simulate_many(blocks, moved, model=model, friction=(0.32, 0.3), polarity="-")
            for k in range(4):
                response = rocking.simulate(
                    blocks[k],
                    moved.scaled(-1.0) if moved.vertical is None else _turned(moved),
                    model=model,
                    friction=(0.32, 0.3),
                )
                found = [
                    float(data[name].values.ravel()[k]) for name in ("peak_rotation", "largest_slip", "residual_slip")
                ]
                expected = response.peak_rotation, response.largest_slip, response.residual_slip
                assert found == pytest.approx(expected, abs=1e-9)
                slips += response.slips
    assert slips >= 8


def _turned(motion: rocking.Motion) -> rocking.Motion:
    assert motion.vertical is not None
    return rocking.Motion(motion.breakpoints, -motion.coefficients, vertical=motion.vertical)


def test_analyses_with_friction() -> None:
    """Friction below the slenderness prevents rocking, and infinite friction changes nothing."""
    block = rocking.Block.from_parameters(p=2.0, alpha=0.3, restitution=0.9)
    pulses = [rocking.pulses.one_sine(1.0, f) for f in (0.4, 0.8)]
    levels = [2.0, 5.0, 9.0]
    bands = rocking.incremental_dynamic_analysis(block, pulses, levels=levels, friction=0.25)
    assert float(bands.data.peak_rotation.max()) == 0.0
    free, bound = (
        rocking.incremental_dynamic_analysis(block, pulses, levels=levels, friction=mu) for mu in (None, math.inf)
    )
    assert free.data.equals(bound.data)
    options = {"amplitudes": [1.5, 4.0], "frequencies": [1.0, 3.0]}
    sliding = rocking.overturning_map(block, "one-sine", friction=0.25, **options)
    assert float(sliding.data.peak_rotation.max()) == 0.0
    blocks = rocking.Blocks.grid(p=[1.0, 2.0], alpha=[0.3], restitution=[0.9])
    spectrum = rocking.rocking_spectrum(blocks, [pulse.scaled(6.0) for pulse in pulses], friction=0.25)
    assert float(spectrum.data.peak_rotation.max()) == 0.0


@pytest.mark.parametrize("chattering", ["velocity=1e-4", "bypass=1e-3", "interval=1e-4"])
def test_thresholds_end_sequences_that_slip(chattering: str) -> None:
    block = rocking.Block(width=0.5, height=1.8, restitution=0.85)
    motion = rocking.pulses.one_sine(amplitude=5.0, frequency=2.0)
    exact, cut = (rocking.simulate(block, motion, friction=0.3, chattering=name) for name in ("certified", chattering))
    assert cut.residual_slip == pytest.approx(exact.residual_slip, abs=1e-9)
    assert cut.duration == pytest.approx(exact.duration, abs=1e-3)


def test_a_duration_stops_a_slide() -> None:
    block = rocking.Block(width=0.5, height=1.8)
    motion = rocking.pulses.one_sine(amplitude=5.0, frequency=2.0)
    whole, cut = (rocking.simulate(block, motion, friction=0.25, duration=end) for end in (None, 0.2))
    assert cut.ended_early and cut.outcome == "has not overturned" and cut.duration == 0.2
    assert cut.residual_slip == pytest.approx(float(whole.slip(0.2)), abs=1e-15)
    data = rocking.simulate_many(block, motion, friction=0.25, duration=0.2)
    assert bool(data.ended_early.item()) and float(data.residual_slip.item()) == cut.residual_slip


def test_outputs_contain_the_slip(tmp_path: Any, run: Any) -> None:
    block = rocking.Block(width=0.5, height=1.8, restitution=0.85)
    response = rocking.simulate(block, rocking.pulses.one_sine(5.0, 2.0), friction=(0.3, 0.28))
    dataset = response.to_xarray()
    assert {"slip", "slip_velocity"} <= set(dataset.data_vars) and dataset.attrs["friction"] == [0.3, 0.28]
    assert response.to_dict()["largest_slip_m"] == response.largest_slip > 0.0
    assert "0.3 (static), 0.28 (kinetic)" in response.summary() and "mm at most" in response.summary()
    assert "slip (mm)" in [axes.get_ylabel() for axes in response.plot().axes]
    record = tmp_path / "record.csv"
    record.write_text("\n".join(f"{5.0 * math.sin(4.0 * math.pi * 0.01 * k)}" for k in range(51)))
    sizes = ("--width", 0.5, "--height", 1.8, "--restitution", 0.85)
    code, text, _ = run("simulate", record, "--dt", 0.01, "--units", "m/s2", *sizes, "--friction", "0.3,0.28")
    assert code == 0 and "slide-rock" in text and "mm at most" in text


def test_a_study_with_friction_is_the_same_after_it_is_opened_again(tmp_path: Any) -> None:
    bodies = [rocking.Block.from_pivots((0.2, 0.25), 1.0, 0.6), rocking.Block.from_pivots((0.2, 0.2), 1.0, 0.65)]
    motion = rocking.pulses.one_sine(2.6, 1.2)
    study = rocking.create_study(tmp_path / "study", bodies, motion, friction=(0.3, 0.25), blocks_per_batch=512)
    study.run()
    again = rocking.Study(tmp_path / "study")
    assert again.product.friction == (0.3, 0.25)
    expected = [rocking.simulate(body, motion, friction=(0.3, 0.25)).peak_rotation for body in bodies]
    assert again.results().peak_rotation.values.ravel().tolist() == expected


_SCRIPT = """
import rocking
block = rocking.Block(width=0.5, height=1.8, restitution=0.85)
for model in ("nonlinear", "linear"):
    for friction in (0.3, (0.3, 0.2)):
        motion = rocking.pulses.one_sine(5.0, 2.0)
        response = rocking.simulate(block, motion, friction=friction, model=model, duration=1.0)
        print(response.peak_rotation.hex(), response.residual_slip.hex(), response.events["time"].tolist())
"""


def test_python_runs_kernels_with_friction_with_the_same_bits() -> None:
    outputs = []
    for uncompiled in ("0", "1"):
        environment = {**os.environ, "NUMBA_DISABLE_JIT": uncompiled}
        command = [sys.executable, "-W", "ignore::RuntimeWarning", "-c", _SCRIPT]
        outputs.append(subprocess.run(command, env=environment, capture_output=True, text=True, check=True).stdout)
    assert outputs[0] == outputs[1] and outputs[0].count("\n") == 4
