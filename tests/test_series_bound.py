"""Where a series may end: what it leaves out is below its bound, whatever the weight and the push start with."""

import math

import numpy as np
import pytest
from kernel_structs import in_units_of_g, rocking_block, rules_for, state_of
from oracles.taylor import System, angles, coefficients, mp

from rocking.kernels import arc, series
from rocking.kernels.arc import ORDER, evaluate_series, expand_arc
from rocking.kernels.state import create_scratch

pytestmark = pytest.mark.usefixtures("parts_run_by_python")

# Terms after the sixtieth are at most 3e-5 of what a series leaves out, and mostly much less.
CASES = pytest.mark.parametrize(
    ("cases", "terms"),
    [
        (10, 60),
        pytest.param(24, 90, marks=pytest.mark.thorough),
        pytest.param(80, 90, marks=pytest.mark.slow),
    ],
)

Polynomial = list[float]


def drawn(random: np.random.Generator) -> tuple[float, float, float, Polynomial, Polynomial]:
    """Slenderness, rotation, velocity, push and weight about the start of a step; p is 1."""
    alpha = random.uniform(0.05, 0.5)
    u = alpha * random.choice([0.0, 1.0, random.uniform(0.0, 2.0)])
    v = random.choice([0.0, 10.0 ** random.uniform(-6.0, 0.0)])
    power = int(random.integers(0, 9))
    weight = [0.0] * power + [random.choice([-1.0, 1.0]) * 10.0 ** random.uniform(-1.0, 2.0)]
    if random.random() < 0.5:
        weight += [random.normal() for _ in range(int(random.integers(0, 4)))]
    push = random.choice(["none", "next to none", "power", "line"])
    A = {
        "none": [0.0],
        "next to none": [1e-15],
        "power": [0.0] * int(random.integers(0, 9)) + [random.normal()],
        "line": [random.normal(), random.normal()],
    }[push]
    return alpha, u, v, A, weight


@CASES
@pytest.mark.parametrize("nonlinear", [False, True], ids=["linear", "nonlinear"])
def test_a_series_ends_where_what_it_leaves_out_is_nothing(nonlinear: bool, cases: int, terms: int) -> None:
    """Of the velocity at the end of the step: rounding of all terms, and not more, also after terms that vanish."""
    random, lacunary = np.random.default_rng(11), 0
    for _ in range(cases):
        alpha, u, v, push, weight = drawn(random)
        block = rocking_block((1.0, 1.0), (alpha, alpha), nonlinear=nonlinear)
        ground = in_units_of_g([0.0, 1e3], [push], vertical=[[weight[0] - 1.0, *weight[1:]]])
        scratch, start = create_scratch(), state_of(0, u, v, peak=2.0)
        order, h, _ = expand_arc(ground, block, rules_for(nonlinear=nonlinear), scratch, start, 1.0)
        c = coefficients(System(1.0, alpha, nonlinear), u, v, push, weight, terms)
        rates = [k * c[k] * mp.mpf(h) ** k for k in range(1, terms)]
        assert abs(rates[-1]) + abs(rates[-2]) + abs(rates[-9]) <= mp.mpf("1e-25") * max(map(abs, rates))
        largest = float(max(abs(x) for x in rates))
        # Weight and push each round by themselves, and may cancel.
        pulls = h * h * (sum(map(abs, push)) + alpha * sum(map(abs, weight)))
        _, found, _ = evaluate_series(scratch["rotation"], order, h)
        assert abs(found * h - float(sum(rates))) <= 1e-15 * (largest + pulls)
        left_out = float(sum(abs(x) for x in rates[order:]))
        assert left_out <= 2.0**-53 * largest
        lacunary += weight[0] == 0.0
    assert lacunary > 0.3 * cases


@CASES
@pytest.mark.parametrize("order", [9, pytest.param(14, marks=pytest.mark.thorough), ORDER])
@pytest.mark.parametrize("nonlinear", [False, True], ids=["linear", "nonlinear"])
def test_the_bound_holds_all_that_a_series_leaves_out(nonlinear: bool, order: int, cases: int, terms: int) -> None:
    """Term by term from exact coefficients; and it is no more than some hundred times what is left out, mostly."""
    random, judged, ratios = np.random.default_rng(order), 0, []
    for _ in range(cases):
        alpha, u, v, push, weight = drawn(random)
        degree = max(len(push), len(weight)) - 1
        if degree >= order - 1:
            continue
        h = 10.0 ** random.uniform(-1.5, 0.0)
        c = coefficients(System(1.0, alpha, nonlinear), u, v, push, weight, terms)
        scratch = create_scratch()
        for name, values in (("ground", push), ("weight", weight)):
            scratch[name][: len(values)] = values
        scratch["rotation"][: order + 1] = [float(x) for x in c[: order + 1]]
        if nonlinear:
            sine, cosine = angles(alpha, c, order)
            scratch["sine"][:order] = [float(x) for x in sine[:order]]
            scratch["cosine"][:order] = [float(x) for x in cosine[:order]]
            bound, _ = arc.bound_nonlinear_truncation(scratch, 1.0, (len(push) - 1, len(weight) - 1), order, h)
        else:
            bound, _ = arc.bound_linear_truncation(scratch, 1.0, len(weight) - 1, order, h)
        left_out = float(mp.fsum(abs(k * c[k]) * mp.mpf(h) ** k for k in range(order + 1, terms)))
        if math.isinf(bound):
            continue
        judged += 1
        assert left_out <= bound * (1.0 + 1e-9)
        if left_out > 0.0:
            ratios.append(bound / left_out)
    assert judged > 0.5 * cases
    assert np.median(ratios) < 300.0


@pytest.mark.parametrize("count", [1000, pytest.param(4000, marks=pytest.mark.thorough)])
def test_the_bound_of_nine_terms_is_that_of_any_number(count: int) -> None:
    """Its constants cover what feeds back, and its verdict is that of the bound it writes out."""
    random, judged, negligible = np.random.default_rng(0), 0, 0
    for number in range(count):
        scratch = create_scratch()
        # Every other series falls from term to term, so that what is left out may be nothing beside the first ones.
        falls = 10.0 ** -(number % 2 * random.uniform(0.5, 3.0) * np.arange(9.0))
        sizes = 10.0 ** random.uniform(-9.0, -1.0, 9) * falls
        sine, cosine = (random.normal(size=8) * 10.0 ** random.uniform(-9.0, -1.0, 8) * falls[:8] for _ in range(2))
        push, weight = ((float(x) for x in random.normal(size=2) * 10.0 ** random.uniform(-6.0, 0.0, 2)) for _ in "aw")
        push, weight = tuple(push), tuple(weight)
        scratch["rotation"][1:10] = sizes / np.arange(1.0, 10.0)
        scratch["sine"][:8], scratch["cosine"][:8] = sine, cosine
        scratch["ground"][:2], scratch["weight"][:2] = push, weight
        lam, strength = 10.0 ** random.uniform(-4.0, -0.7), series.sum_forcing(weight, push, 1.0)
        angles = np.abs(sine[1:]) + np.abs(cosine[1:])
        if sizes.sum() > 0.25 or lam * strength[0] > 0.25 or angles.sum() > 0.4:
            continue
        judged += 1
        bound, _ = arc.bound_nonlinear_truncation(scratch, lam, (1, 1), 9, 1.0)
        nothing, rest = series.has_negligible_truncation(tuple(sizes), tuple(angles), lam, strength)
        assert rest == pytest.approx(np.arange(2.0, 9.0) @ sizes[2:])
        if nothing:
            negligible += 1
            assert bound <= 2.0**-52 * sizes.sum()
        elif bound > 0.0:
            assert bound >= 0.9 * 2.0**-52 * sizes.sum()
    assert judged > count / 8 and negligible > count / 20
