"""The variation at a rest and at any time against differences between neighbouring responses of many digits."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from kernel_structs import Pair, block_of, ground_of, rules_for
from oracles import multiprecision
from oracles.cases import GRAVITY
from oracles.problem import Problem

import rocking
from rocking.core.constants import Model
from rocking.kernels import state
from rocking.kernels.arc import compute_restoring
from rocking.kernels.state import Struct
from rocking.kernels.trace import Quantity, Trail, compute_rest_shift

pytestmark = pytest.mark.usefixtures("parts_run_by_python")


def node_of(side: int, u: float, v: float, time: float = 0.0) -> Struct:
    return state.create_struct(state.NODE_DTYPE, time=time, piece=0, offset=time, side=side, u=u, v=v)


@pytest.mark.cases(fast=8)
@pytest.mark.parametrize("model", ["linear", "nonlinear"])
@pytest.mark.parametrize("side", [0, 1])
@pytest.mark.parametrize(
    "what", [Quantity.MOTION, Quantity.VELOCITY, Quantity.FREQUENCY, Quantity.SLENDERNESS, Quantity.RESTITUTION]
)
def test_the_shift_of_the_rest_is_its_derivative_by_what_is_changed(model: str, side: int, what: int) -> None:
    """To first order in the speed, for any shift of the impact and any change of the speed after it."""
    problem = Problem(model, (2.0, 3.0), (0.2, 0.15), (0.7, 0.5), np.array([0.0, 50.0]), np.array([[0.4, 0.9]]))
    start, v, shift, faster, step = 1.0, 1e-6, 0.3, 2e-6, 1e-7

    def scaled(values: Pair, which: int, strength: float) -> Pair:
        return tuple(x * (1.0 + strength) if what == which else x for x in values)

    def rest(strength: float) -> multiprecision.Number:
        changed = replace(
            problem,
            coefficients=problem.coefficients * (1.0 + strength if what == Quantity.MOTION else 1.0),
            p=scaled(problem.p, Quantity.FREQUENCY, strength),
            alpha=scaled(problem.alpha, Quantity.SLENDERNESS, strength),
            restitution=scaled(problem.restitution, Quantity.RESTITUTION, strength),
        )
        return multiprecision.rest_time(changed, start + strength * shift, 1 - 2 * side, v + strength * faster)

    block = block_of(problem)
    dv = faster + compute_restoring(ground_of(problem), block, side, 0, start) * shift
    trail = Trail(
        ground_of(problem), block, rules_for(nonlinear=model == "nonlinear"), state.create_structs(0, state.NODE_DTYPE)
    )
    # What happens to the speed at the impact itself is in dv.
    node, later = node_of(side, 0.0, v, start), node_of(state.AT_REST, 0.0, 0.0, start + 1e-4)
    found = compute_rest_shift(trail, node, what, (dv, shift, 0.0, 0.0), later)
    slope = float((rest(step) - rest(-step)) / (2.0 * step))
    assert found - shift == pytest.approx(slope - shift, rel=1e-3)


# ---- Rotations at any time ----

PER_SIDE = tuple(f"{name}_{side}" for name in ("p", "alpha", "restitution") for side in ("plus", "minus"))
EVERY = ("motion", "initial_rotation", "initial_velocity", "p", "alpha", "restitution", *PER_SIDE)


def changed(problem: Problem, name: str, strength: float) -> Problem:
    """Change what a name stands for by a share of itself; numbers of few binary digits leave no rounding."""
    kind, _, side = name.partition("_")
    if kind == "motion":
        return replace(problem, coefficients=problem.coefficients * (1.0 + strength))
    if kind == "initial":
        return problem
    sides = {"plus": (1.0, 0.0), "minus": (0.0, 1.0), "": (1.0, 1.0)}[side]
    pair = tuple(x * (1.0 + strength * share) for x, share in zip(getattr(problem, kind), sides, strict=True))
    changes: dict[str, Any] = {kind: pair}
    return replace(problem, **changes)


def judged_rotations(seed: int, model: Model, names: tuple[str, ...]) -> int:
    """Judge what changes the rotation at a dozen times; returns how many derivatives, other than zeros, were judged."""
    rng = np.random.default_rng(seed)
    ranges = ((1.5, 4.0), (0.1, 0.25), (0.6, 0.95))
    p, alpha, restitution = (tuple(np.round(rng.uniform(*each, 2) * 64.0) / 64.0) for each in ranges)
    rough = np.convolve(rng.normal(size=14), np.ones(3), mode="valid")
    drawn = rocking.Motion.from_samples(rough * 2.0 * min(alpha) * GRAVITY / np.max(np.abs(rough)), 0.125)
    problem = Problem(model, p, alpha, restitution, drawn.breakpoints, np.round(drawn.coefficients * 1024.0) / 1024.0)
    starts = {"initial_rotation": 2.0**-6, "initial_velocity": -(2.0**-4)}
    response = rocking.simulate(
        rocking.Block.from_parameters(p, alpha, restitution),
        rocking.Motion(problem.breakpoints, problem.coefficients),
        model=model,
        initial_rotation=starts["initial_rotation"],
        initial_velocity=starts["initial_velocity"],
    )
    times = np.sort(rng.uniform(0.0, min(response.duration, 2.5), 12))
    assert np.min(np.abs(times[:, None] - response.impacts["time"])) > 1e-6
    found = response.sensitivity.rotation(times, inputs=names)
    h, judged = 2.0**-36, 0
    for name in names:
        rotations = []
        for strength in (h, -h):
            begun = {each: value * (1.0 + strength * (each == name)) for each, value in starts.items()}
            course = multiprecision.follow(
                changed(problem, name, strength),
                rotation=begun["initial_rotation"],
                velocity=begun["initial_velocity"],
                closest=1e-9,
                digits=30,
                at=times.tolist(),
            )
            rotations.append([course.states.get(time, (0, 0))[0] for time in times])
        expected = np.array([float((one - other) / (2.0 * h)) for one, other in zip(*rotations, strict=True)])
        assert np.all(np.abs(found[name] - expected) <= 1e-8 * max(1e-3, np.max(np.abs(expected)))), (seed, name)
        judged += int(np.count_nonzero(expected))
    return judged


@pytest.mark.parametrize("model", ["linear", "nonlinear"])
def test_the_rotation_at_any_time_changes_as_thirty_digits_say(model: Model) -> None:
    names = ("motion", "alpha_plus", "restitution_minus")
    assert judged_rotations(4, model, names) >= 24


@pytest.mark.parametrize("model", ["linear", "nonlinear"])
@pytest.mark.parametrize(
    "seed", [pytest.param(k, marks=pytest.mark.slow if k else pytest.mark.thorough) for k in range(4)]
)
def test_the_rotation_at_any_time_changes_with_everything_as_thirty_digits_say(seed: int, model: Model) -> None:
    assert judged_rotations(seed, model, EVERY) >= 120


def test_changes_of_the_rotation_are_zero_at_rest_none_outside_and_the_sum_of_both_sides() -> None:
    block = rocking.Block.from_parameters(p=(2.0, 2.5), alpha=(0.2, 0.15), restitution=(0.8, 0.7))
    response = rocking.simulate(block, rocking.pulses.one_sine(2.5, 1.0), initial_rotation=-0.05, duration=20.0)
    (start, end) = response.rest_intervals[-1]
    assert (start < 19.0, end) == (True, 20.0)
    times = np.array([[0.5 * start, -0.1, 0.9 * start], [19.5, np.nan, 20.1]])
    found = response.sensitivity.rotation(times, inputs=EVERY)
    assert {values.shape for values in found.values()} == {(2, 3)}
    for name in ("p", "alpha", "restitution"):
        together = found[f"{name}_plus"] + found[f"{name}_minus"]
        assert found[name][0, [0, 2]] == pytest.approx(together[0, [0, 2]], rel=1e-11)
        assert np.all(found[name][0, [0, 2]])
    for values in found.values():
        assert np.array_equal(np.isnan(values), [[False, True, False], [False, True, True]])
        assert values[1, 0] == 0.0
    assert response.sensitivity.rotation(0.0)["initial_rotation"] == pytest.approx(-0.05, rel=1e-15)
    with pytest.raises(rocking.errors.OptionError, match=r"inputs must be among motion, .*, not 'gravity'"):
        response.sensitivity.rotation(times, inputs=["gravity"])


def test_changes_of_the_rotation_just_before_a_proven_rest_are_those_of_its_bounces() -> None:
    """A sequence is closed by a proof while it still bounces; what follows is followed for the changes, too."""
    block = rocking.Block.from_parameters(p=2.0, alpha=0.2, restitution=0.8)
    response = rocking.simulate(block, None, initial_rotation=0.05)
    last = float(response.impacts["time"][-1])
    times = np.linspace(last, response.duration, 30)[1:20]
    assert np.max(np.abs(response.rotation(times))) > 0.0
    found = response.sensitivity.rotation(times)["p"]
    # p scales the time alone.
    assert found == pytest.approx(times * response.angular_velocity(times), rel=1e-6, abs=1e-13)
