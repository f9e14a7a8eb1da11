"""Laws of friction at a pivot: impacts in 40 digits, their dissipation, and balances of the oracle itself."""

import itertools
import math

import mpmath
import numpy as np
import pytest
from oracles.sliding import G, Slider, follow, sampled


def draw_body(rng: np.random.Generator, *, symmetric: bool = False) -> Slider:
    height = 10.0 ** rng.uniform(-1.0, 0.5)
    slopes = np.tan(rng.uniform(0.05, 0.5, 2))
    plus, minus = height * (slopes[[0, 0]] if symmetric else slopes)
    k = math.hypot(0.5 * (plus + minus), height) * rng.uniform(0.45, 0.75)
    limit = 2.0 * k / math.hypot(max(plus, minus), height)
    friction = min(rng.uniform(0.02, 1.2), 0.9 * limit * math.hypot(1.0, 0.5 * limit))
    return Slider.on_pivots((plus, minus), height, k, float(friction))


def with_factors(body: Slider, rng: np.random.Generator) -> Slider | None:
    """The body with other factors, or None if they might gain energy (section 5 of the theory)."""
    k2, h = body.gyration[0], body.height
    squares = [k2 + d * d for d in body.distances]
    factors = tuple(
        float(
            rng.uniform(
                max(0.0, h * h - math.sqrt(squares[0] * squares[1])), h * h + math.sqrt(squares[0] * squares[1])
            )
        )
        / (k2 + h * h + body.distances[1 - n] ** 2)
        for n in range(2)
    )
    if not all(0.0 < factor <= 1.0 for factor in factors):
        return None
    return Slider(**{**body.__dict__, "factors": factors})


def solve_impact(body: Slider, i: int, w: float, V: float) -> list[tuple[float, float]]:
    """All (speed, slip) after an impact that satisfy momentum, complementarity and Coulomb's law, in 40 digits.

    The new pivot stops. The old one leaves the ground without an impulse or, if that is impossible, also stops.
    """
    mp = mpmath.mp.clone()
    mp.dps = 40
    n, m, j = (0 if i > 0 else 1), (1 if i > 0 else 0), -i
    d, e, h, k2 = (mp.mpf(x) for x in (body.distances[n], body.distances[m], body.height, body.gyration[0]))
    w, V, mu = mp.mpf(w), mp.mpf(V), mp.mpf(body.kinetic)
    couple = (mp.mpf(body.factors[n]) * (k2 + h * h + e * e) - (k2 + h * h - d * e)) * w
    found, stopped = [], []
    for sigma in (0, 1, -1):
        # Unknowns: speed, slip, impulses across and upward. Old pivot free.
        law = [0, 1, 0, 0] if sigma == 0 else [0, 0, 1, sigma * mu]
        rows = [[k2, 0, j * h, e], [-j * h, -1, 1, 0], [-e, 0, 0, 1], law]
        speed, slip, across, upward = mp.lu_solve(
            mp.matrix(rows), mp.matrix([k2 * w + couple, -V - j * h * w, d * w, 0])
        )
        holds = abs(across) <= mu * upward if sigma == 0 else sigma * slip > 0
        if speed > 0 and upward >= 0 and holds:
            found.append((float(speed), float(slip)))
        # Both pivots stop: no speed, and two upward impulses that must not pull.
        across = -V - j * h * w if sigma == 0 else -sigma * mu * d * w
        slip = V + j * h * w + across
        holds = abs(across) <= mu * d * w if sigma == 0 else sigma * slip > 0
        # The upward impulses must not pull; a prescribed loss acts as far as there is speed to lose.
        olds = [(-k2 * w - share * couple + j * h * across + e * d * w) / (d + e) for share in (0, 1)]
        if max(olds) >= 0 and holds and min(olds) <= d * w:
            stopped.append((0.0, float(slip)))
    return found or stopped


@pytest.mark.parametrize("prescribed", [False, True])
def test_exactly_one_result_of_an_impact_satisfies_complementarity(prescribed: bool) -> None:
    rng = np.random.default_rng(17 + prescribed)
    compared = 0
    while compared < 250:
        body = draw_body(rng)
        if prescribed and (body := with_factors(body, rng)) is None:
            continue
        w, i = 10.0 ** rng.uniform(-3.0, 1.0), int(rng.choice([-1, 1]))
        V = float(rng.choice([0.0, 1.0])) * body.height * w * rng.normal()
        results = solve_impact(body, i, w, V)
        speed, slip, _, _ = body.impact(i, w, V)
        assert len(results) == 1
        assert (speed, slip) == pytest.approx(results[0], abs=1e-13 * w * max(1.0, body.height))
        compared += 1


def test_no_impact_within_the_bounds_of_restitution_gains_energy() -> None:
    rng = np.random.default_rng(5)
    checked = 0
    while checked < 3000:
        body = draw_body(rng)
        if rng.random() < 0.7 and (body := with_factors(body, rng)) is None:
            continue
        i, w, V = int(rng.choice([-1, 1])), 1.0, float(body.height * rng.normal() * 10.0 ** rng.uniform(-2, 1))
        speed, slip, _, _ = body.impact(i, w, V)
        before, after = body.moments(i, 0.0, -w, V)[2], body.moments(-i, 0.0, speed, slip)[2]
        assert after <= before * (1.0 + 1e-12)
        checked += 1


def test_a_restitution_beyond_its_bounds_gains_energy_in_some_slip() -> None:
    body = Slider.on_pivots((0.3, 0.3), 1.0, 0.5, 0.9, (1.2, 1.2))
    gains = [
        body.moments(-1, 0.0, *body.impact(1, 1.0, V)[:2])[2] - body.moments(1, 0.0, -1.0, V)[2]
        for V in np.linspace(-3, 3, 61)
    ]
    assert max(gains) > 1e-3


def test_arcs_that_slide_return_with_their_speed_and_impacts_multiply_it_by_one_factor() -> None:
    """Equations (11) and (12): T G/(2 w) = 1 + O(w^2), and speeds fall by exactly the factor."""
    rng = np.random.default_rng(3)
    checked = 0
    for _ in range(80):
        body = draw_body(rng)
        sigma = int(rng.choice([-1, 1]))
        if body.kinetic >= body.slope(sigma):
            continue
        for i, small in itertools.product((1, -1), (1e-3, 1e-4)):
            gravity, factor = body.closing(i, sigma, 0.0, G)
            w = small * gravity * math.sqrt(body.height / G)
            time, speed = _arc_duration(body, i, sigma, w)
            assert speed == pytest.approx(w, rel=1e-9)
            assert time * gravity / (2.0 * w) == pytest.approx(1.0, abs=30.0 * small**2)
            after, slip, _, _ = body.impact(i, w, 100.0 * sigma * body.height)
            assert after == pytest.approx(max(0.0, factor) * w, rel=1e-12) and slip * sigma > 0.0
            checked += 1
    assert checked >= 40


def _arc_duration(body: Slider, i: int, sigma: int, w: float) -> tuple[float, float]:
    from scipy.integrate import solve_ivp

    def rate(_: float, y: np.ndarray) -> list[float]:
        return [y[1], body.slip(i, sigma, y[0], y[1], 0.3, G)[0]]

    def lands(_: float, y: np.ndarray) -> float:
        return float(y[0])

    lands.terminal, lands.direction = True, -1  # type: ignore[attr-defined]
    run = solve_ivp(rate, (0.0, 10.0), [0.0, w], method="DOP853", rtol=1e-12, atol=1e-18, events=lands)
    return float(run.t_events[0][0]), float(-run.y_events[0][0][1])


@pytest.mark.parametrize("linear", [False, True])
def test_energy_and_momentum_of_the_oracle_balance(linear: bool) -> None:
    rng = np.random.default_rng(11 + linear)
    modes = set()
    for _ in range(12):
        alpha = rng.uniform(0.1, 0.4)
        friction = float(alpha * rng.uniform(0.6, 1.8))
        if linear:
            e = 1.0 - 1.5 * math.sin(alpha) ** 2
            body = Slider.slender((2.5, 2.5), (alpha, alpha), (e, e), 0.75 * G / 6.25, friction)
        else:
            body = Slider.on_pivots((math.tan(alpha), 0.8 * math.tan(alpha)), 1.0, 0.6, friction)
        samples = 6.0 * rng.normal(size=60)
        samples[-1] = 0.0
        run = follow(body, sampled(0.05, samples.tolist(), None if linear else (3.0 * rng.normal(size=60)).tolist()))
        assert max(run.balance) < 1e-11
        modes |= {mode for _, mode, _, _ in run.modes}
    assert {"slide", "rock", "slide-rock"} <= modes
