"""All recurrences of an arc against one calculation in 60 digits, coefficient by coefficient."""

import math
from collections.abc import Callable, Sequence

import numpy as np
import pytest
from kernel_structs import ULP, in_units_of_g, one_sided, rocking_block, rules_for, state_of
from oracles.taylor import Line, Number, System, coefficients, mp

from rocking.core.arrays import Floats
from rocking.kernels import state
from rocking.kernels.series import (
    compute_nonlinear_coefficient,
    compute_nonlinear_terms,
    compute_weighted_coefficient,
    compute_weighted_terms,
    expand_linear,
    expand_nonlinear,
    expand_weighted,
    write_angle_coefficients,
    write_linear_coefficients,
)
from rocking.kernels.state import ORDER, Struct, create_scratch
from rocking.kernels.trace import Quantity, Trail, expand_variation

pytestmark = pytest.mark.usefixtures("parts_run_by_python")

Start = tuple[float, float]
Series = list[float]
Form = Callable[[System, Start, Line, Line], Series]


def body(system: System) -> Struct:
    """Something with this equation on side 0, whatever it is elsewhere."""
    made = one_sided(system.lam, float(system.gained), system.alpha, 0.5)
    made["slenderness"] = system.alpha
    return made


def scratch_with(push: Line, weight: Line) -> Struct:
    scratch = create_scratch()
    scratch["ground"][:2], scratch["weight"][:2] = push, weight
    return scratch


def linear_any_order(system: System, start: Start, push: Line, weight: Line) -> Series:
    scratch = scratch_with(push, weight)
    write_linear_coefficients(body(system), state_of(0, *start), scratch, 1, ORDER)
    return list(scratch["rotation"][: ORDER + 1])


def weighted_any_order(system: System, start: Start, push: Line, weight: Line) -> Series:
    scratch = scratch_with(push, weight)
    scratch["rotation"][:2] = start
    for k in range(ORDER - 1):
        scratch["rotation"][k + 2] = compute_weighted_coefficient(body(system), 0, scratch, 1, k)
    return list(scratch["rotation"][: ORDER + 1])


def nonlinear_any_order(system: System, start: Start, push: Line, weight: Line) -> Series:
    scratch = scratch_with(push, weight)
    scratch["rotation"][:2] = start
    scratch["sine"][0], scratch["cosine"][0] = angle(system, start)
    for k in range(ORDER - 1):
        scratch["rotation"][k + 2] = compute_nonlinear_coefficient(system.lam, scratch, (1, 1), k)
        write_angle_coefficients(scratch, k)
    return list(scratch["rotation"][: ORDER + 1])


def angle(system: System, start: Start) -> Line:
    return math.sin(system.alpha - start[0]), math.cos(system.alpha - start[0])


def pushed(system: System, push: Line) -> Line:
    return float(system.gained) * push[0], float(system.gained) * push[1]


def linear_nine(system: System, start: Start, push: Line, weight: Line) -> Series:
    gain = float(system.gained)
    return list(expand_linear(*start, system.lam, gain * (system.alpha + push[0]), gain * push[1]))


def weighted_nine(system: System, start: Start, push: Line, weight: Line) -> Series:
    at_rest = float(system.gained) * system.alpha
    return list(expand_weighted(*start, system.lam, at_rest, pushed(system, push), weight))


def nonlinear_nine(system: System, start: Start, push: Line, weight: Line) -> Series:
    return list(expand_nonlinear(start, angle(system, start), system.lam, push, weight)[0])


def nonlinear_nine_at_rest(system: System, start: Start, push: Line, weight: Line) -> Series:
    return list(expand_nonlinear(start, angle(system, start), system.lam, push, None)[0])


def integrated(u: float, rates: tuple[float, ...]) -> Series:
    return [u, *(rate / (k + 1) for k, rate in enumerate(rates))]


def weighted_lanes(system: System, start: Start, push: Line, weight: Line) -> Series:
    z = system.lam * start[0] - float(system.gained) * system.alpha
    nine, *others = compute_weighted_terms(start[1], z, system.lam, pushed(system, push), weight)
    return integrated(start[0], (*nine, *others))


def nonlinear_lanes(system: System, start: Start, push: Line, weight: Line) -> Series:
    return integrated(
        start[0], compute_nonlinear_terms(start[1], angle(system, start), -0.5 * system.lam, push, weight)[0]
    )


def nonlinear_lanes_at_rest(system: System, start: Start, push: Line, weight: Line) -> Series:
    return integrated(
        start[0], compute_nonlinear_terms(start[1], angle(system, start), -0.5 * system.lam, push, None)[0]
    )


#: Each with the number of terms that it has, and whether the weight changes.
FORMS: list[tuple[Form, bool, int]] = [
    (linear_any_order, False, ORDER), (weighted_any_order, True, ORDER), (nonlinear_any_order, True, ORDER),
    (linear_nine, False, 9), (weighted_nine, True, 9), (nonlinear_nine, True, 9), (nonlinear_nine_at_rest, False, 9),
    (weighted_lanes, True, 11), (nonlinear_lanes, True, 9), (nonlinear_lanes_at_rest, False, 9),
]  # fmt: skip


def drawn(random: np.random.Generator, nonlinear: bool, weighted: bool) -> tuple[System, Start, Line, Line]:
    """An equation, a start, a push and a weight of all sizes and signs, balanced and without weight, too."""

    def size(low: float, high: float) -> float:
        return float(random.choice([-1.0, 1.0]) * 10.0 ** random.uniform(low, high))

    alpha = 10.0 ** random.uniform(-2.0, 0.0)
    lam = 10.0 ** random.uniform(-2.0, 2.0)
    gain = lam * random.uniform(0.2, 3.0)
    if not nonlinear:
        lam *= random.choice([1.0, 0.0, -1.0])
    u = float(random.choice([0.0, alpha, alpha * random.uniform(0.0, 2.0)]))
    v = float(random.choice([0.0, size(-6.0, 0.5)]))
    push = (0.0, 0.0) if random.random() < 0.2 else (alpha * size(-3.0, 1.0), size(-3.0, 1.0))
    weight = (float(random.choice([0.0, size(-3.0, 1.0)])), size(-3.0, 1.0)) if weighted else (1.0, 0.0)
    return System(lam, alpha, nonlinear, None if nonlinear else gain), (u, v), push, weight


@pytest.mark.parametrize("draws", [20, pytest.param(60, marks=pytest.mark.thorough)])
@pytest.mark.parametrize(("form", "weighted", "terms"), FORMS, ids=[form.__name__ for form, *_ in FORMS])
def test_every_coefficient_is_that_of_the_equation_of_motion(
    form: Form, weighted: bool, terms: int, draws: int
) -> None:
    """To a few units in the last place of the sizes that it is the sum of."""
    random, judged = np.random.default_rng(terms), 0
    for _ in range(draws):
        system, start, push, weight = drawn(random, "nonlinear" in form.__name__, weighted)
        found = form(system, start, push, weight)
        assert len(found) == terms + 1
        expected = coefficients(system, *start, push, weight, terms)
        sizes = coefficients(system, *start, push, weight, terms, sizes=True)
        for k, (one, exact, size) in enumerate(zip(found, expected, sizes, strict=True)):
            assert abs(one - exact) <= (1.0 + k) * ULP * size, (k, system, start, push, weight)
            judged += size > 0
    assert judged > 35 * terms * draws / 60


def derivative(
    quantity: Quantity, system: System, start: Sequence[Number], push: Floats, lift: Floats, order: int
) -> Series:
    """Change of an arc's coefficients per relative change of a quantity, by a difference of arcs in 60 digits.

    ``start`` is u, v and how they change anyway.
    """
    u, v, du, dv = start

    def arc(epsilon: Number) -> list[Number]:
        more = {one: 1 + (epsilon if one == quantity else 0) for one in Quantity}
        lam, alpha = system.lam * more[Quantity.FREQUENCY] ** 2, system.alpha * more[Quantity.SLENDERNESS]
        toward = [mp.mpf(x) * more[Quantity.MOTION] for x in push]
        weight = [(k == 0) + mp.mpf(x) * more[Quantity.MOTION] for k, x in enumerate(lift)]
        changed = System(lam, alpha, system.nonlinear)
        return coefficients(changed, u + epsilon * du, v + epsilon * dv, toward, weight, order)

    tiny = mp.mpf(10) ** -20
    return [(x - y) / (2 * tiny) for x, y in zip(arc(tiny), arc(-tiny), strict=True)]


@pytest.mark.parametrize("arcs", [2, pytest.param(10, marks=pytest.mark.thorough)])
@pytest.mark.parametrize("quantity", Quantity)
@pytest.mark.parametrize("nonlinear", [False, True], ids=["linear", "nonlinear"])
@pytest.mark.parametrize("weighted", [False, True], ids=["at rest", "weighted"])
def test_the_variation_along_an_arc_is_the_derivative_by_what_is_changed(
    quantity: Quantity, nonlinear: bool, weighted: bool, arcs: int
) -> None:
    random, judged = np.random.default_rng(quantity), 0
    for _ in range(arcs):
        alpha, p, side = random.uniform(0.05, 0.5), 10.0 ** random.uniform(-0.5, 0.5), int(random.integers(2))
        h, degree = 0.3 / p, int(random.integers(6))
        u, v, du, dv = random.uniform(-1.0, 1.0, 4) * (1.0, p, 1.0, p)
        u = abs(u)
        push = random.uniform(-1.0, 1.0, degree + 1) / h ** np.arange(degree + 1.0)
        lift = random.uniform(-0.5, 0.5, degree + 1) / h ** np.arange(degree + 1.0) if weighted else np.zeros(1)
        block = rocking_block((p, p), (alpha, alpha), nonlinear=nonlinear)
        ground = in_units_of_g([0.0, 9.0], [push], vertical=[lift] if weighted else None)
        trail = Trail(ground, block, rules_for(nonlinear=nonlinear), state.create_structs(0, state.NODE_DTYPE))
        node = state.create_struct(state.NODE_DTYPE, time=0.0, piece=0, offset=0.0, side=side, u=u, v=v)
        work = state.create_struct(state.VARIATION_DTYPE)
        order = expand_variation(trail, create_scratch(), work, node, quantity, (du, dv, 0.0), h)
        name, _, of_side = quantity.name.partition("_")
        of_this = Quantity[name] if of_side in ("", ("PLUS", "MINUS")[side]) else Quantity.NOTHING
        system = System(float(block["stiffness"][0]), alpha, nonlinear)
        expected = derivative(of_this, system, (u, v, du, dv), (1 - 2 * side) * push, lift, order)
        terms = [x * mp.mpf(h) ** k for k, x in enumerate(expected)]
        for k in range(order + 1):
            assert abs(work["rotation"][k] * h**k - terms[k]) <= 64.0 * ULP * (1.0 + max(map(abs, terms)))
        judged += order
    assert judged > 8 * arcs
