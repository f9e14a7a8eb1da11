"""All that a response tells is the same of the mirrored body under the mirrored motion, but for sides and signs."""

import numpy as np
import pytest

import rocking
from rocking import Damper, Load, RestrainedBlock, Spring, Tendon, Thrust, gradient

FAR, NEAR = 1.2, 1.0

#: What holds a body whose sides differ, on a way (1, or -1 for its mirror image), and how far it leans.
BODIES = {
    "free": lambda way: ((), 0.0),
    "leaning": lambda way: ((), 0.03 * way),
    "tendon aside": lambda way: ((Tendon(3e4, prestress=2e3, offset=-0.1 * way),), 0.0),
    "yielding tendon": lambda way: ((Tendon(1e5, prestress=1e3, strength=2.5e3),), 0.0),
    "spring and damper": lambda way: ((Spring(4e3), Damper(3e3)), 0.0),
    "thrust": lambda way: ((Thrust(900.0 * way, height=3.0),), 0.0),
    "load": lambda way: ((Load(400.0, 3.0, offset=0.1 * way, moves_with_block=False),), 0.0),
    "load that follows": lambda way: ((Load(400.0, 3.0, offset=0.1 * way),), 0.0),
}

TOLD = [("peak", None), ("rotation", 0.8), ("velocity", 0.8), ("event", 0), ("event", -1), ("impact", 0), ("impact", 2)]


def body_of(name, way):
    restraints, lean = BODIES[name](way)
    pivots, restitution = ((FAR, NEAR), (0.8, 0.75)) if way > 0 else ((NEAR, FAR), (0.75, 0.8))
    block = rocking.Block.from_pivots(pivots, 3.5, 2.3, mass=2e3, restitution=restitution)
    return block if name == "free" else RestrainedBlock(block, *restraints, lean=lean)


def same(one, other, what):
    assert np.shape(one) == np.shape(other), what
    np.testing.assert_allclose(one, other, rtol=1e-8, atol=1e-10, err_msg=what)


def same_answers(one, other, model):
    for table in ("events", "impacts"):
        assert np.array_equal(getattr(one, table)["side"], -getattr(other, table)["side"])
        for field in set(getattr(one, table).dtype.names) - {"side", "kind"}:
            same(getattr(one, table)[field], getattr(other, table)[field], f"{table}.{field}")
    numbers = (
        "peak_rotation",
        "peak_time",
        "required_friction",
        "minimum_normal_force",
        "lift_off_time",
        "time_at_rest",
    )
    for number in (*numbers, "duration", "overturned", "tipping_time", "overturn_time"):
        same(getattr(one, number), getattr(other, number), number)
    same(one.balance, other.balance[::-1], "balance")
    same(one.block.uplift_thresholds(model), other.block.uplift_thresholds(model)[::-1], "thresholds")
    times = np.linspace(0.0, min(one.duration, other.duration), 41)[:-1] + 1e-4
    for history in ("rotation", "angular_velocity", "angular_acceleration"):
        same(getattr(one, history)(times), -getattr(other, history)(times), history)
    yields = "yielding" in str(one.block)
    energies = () if yields else ("kinetic_energy", "potential_energy")  # it keeps none
    for history in ("normal_force", "friction_demand", *energies):
        same(getattr(one, history)(times), getattr(other, history)(times), history)
    for field in one.tendons.dtype.names if len(one.tendons) else ():
        same(one.tendons[field], other.tendons[field], field)


def same_sensitivities(one, other):
    times = np.linspace(0.0, min(one.duration, other.duration), 16)[:-1] + 1e-4
    for quantity in ("motion", "initial_rotation", "initial_velocity", "p", "alpha", "restitution"):
        for rows in ("peak", "impacts", "events"):
            first, second = (getattr(each.sensitivity, rows)[quantity][:3] for each in (one, other))
            same(first, second, f"{rows} by {quantity}")
    by_side = [f"{each}_{side}" for each in ("p", "alpha", "restitution") for side in ("plus", "minus")]
    first, second = (each.sensitivity.rotation(times, inputs=by_side) for each in (one, other))
    for each in by_side:
        swapped = each.replace("plus", "minus") if "plus" in each else each.replace("minus", "plus")
        same(first[each], -second[swapped], each)


def same_gradients(one, other):
    judged = 0
    for of, at in TOLD:
        if (of == "impact" and at >= len(one.impacts)) or (of == "event" and not len(one.events)):
            continue
        first, second = gradient(one, of, at), gradient(other, of, at)
        assert first.reason == second.reason
        sign = -1.0 if of in ("rotation", "velocity") else 1.0
        same(first.value, sign * second.value, of)
        same(first.coefficients, -sign * second.coefficients, of)
        same(first.initial_rotation, -sign * second.initial_rotation, f"{of} by rotation")
        same(first.initial_velocity, -sign * second.initial_velocity, f"{of} by velocity")
        if first.vertical is not None:
            same(first.vertical, sign * second.vertical, f"vertical {of}")
        judged += not first.reason
    return judged


@pytest.mark.parametrize(
    ("model", "start"),
    [
        *(("linear", "rest"), ("linear", "side -"), ("nonlinear", "rest"), ("nonlinear", "side +")),
        *(pytest.param(*each, marks=pytest.mark.thorough) for each in (("linear", "side +"), ("nonlinear", "side -"))),
    ],
)
@pytest.mark.parametrize("name", BODIES)
def test_a_mirrored_response_tells_the_same(name, model, start):
    pulse = rocking.pulses.sine(3.6, 0.9, cycles=2)
    if start != "side -":
        pulse = pulse.with_vertical(rocking.pulses.sine(2.0, 1.7, cycles=2))
    u = {"rest": 0.0, "side +": 0.02, "side -": -0.02}[start]
    one, other = (
        rocking.simulate(
            body_of(name, way),
            pulse * way,
            model=model,
            initial_rotation=way * u,
            initial_velocity=way * (-2.0) * u,
            duration=pulse.end,
        )
        for way in (1, -1)
    )
    assert len(one.impacts) >= 1 and not one.ambiguous
    same_answers(one, other, model)
    same_sensitivities(one, other)
    assert same_gradients(one, other) >= 3 or start == "rest"


@pytest.mark.parametrize("model", ["linear", "nonlinear"])
def test_the_other_polarity_of_an_ensemble_is_the_mirrored_body(model):
    motion = rocking.pulses.sine(3.6, 0.9, cycles=2).with_vertical(rocking.pulses.sine(2.0, 1.7, cycles=2))
    for kind in ("free", "restrained"):
        names = ["free"] if kind == "free" else [name for name in BODIES if name != "free"]
        here, there = (
            rocking.simulate_many(
                [body_of(name, way) for name in names], motion, levels=[0.8, 1.2], polarity="both", model=model
            )
            for way in (1, -1)
        )
        for name, values in here.data_vars.items():
            if "polarity" in values.dims:
                same(values.values, there[name].isel(polarity=slice(None, None, -1)).values, str(name))
